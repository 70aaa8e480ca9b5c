#!/usr/bin/env python3
"""White furnaces, reciprocity and reference values: the same at few samples and many, at the origin and far away, in any unit.

  tools/lab/furnaces.py [--itn build/bin/itn] [--quick] [--only NAME]

Each scene has one pixel and a value that is known: by a closed form, by radiative transfer without random numbers
(tests/transport/data/transport.json), or as that of the same scene with lamp and detector exchanged. Rendered are: 64 and 2^16 samples, at the origin
and 10^6 sizes of the scene away, in units from 10^-6 to 10^6; and 2^26 samples at the origin (--quick: 2^20). A value must be within 4.5 standard
errors, beside 10^-6 of it; the standard error of 2^26 samples must be the one of 2^16 over the root of how many more there are, and that
of 64 is taken from there where it is smaller. Prints a table. Exit code 1: one is not."""
import argparse
import json
import math
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
FILM = ('<film type="hdrfilm"><integer name="width" value="1"/><integer name="height" value="1"/>'
        '<rfilter type="box"/></film>')
FEW = 1 << 16
LIMIT = 4.5  # standard errors: one of some hundred values is beyond by chance once in a thousand runs
ROUNDING = 1e-6


class Place:
    """Lengths in a unit, positions from a place."""

    def __init__(self, unit=1.0, away=0.0):
        self.unit, self.away = unit, away

    def position(self, x, y, z):
        return ", ".join(repr((c + self.away) * self.unit) for c in (x, y, z))

    def transform(self, *steps):
        """steps: (tag, attributes) in sizes of the scene, then the unit and the place."""
        text = "".join(f"<{tag} {attributes}/>" for tag, attributes in steps)
        return (f'<transform name="to_world">{text}<scale value="{self.unit!r}"/>'
                f'<translate value="{self.position(0, 0, 0)}"/></transform>')


def camera(place, b):
    """Sees one point at distance b from the axis."""
    size = 1e-4 * place.unit
    clip = f'<float name="near_clip" value="{place.unit / 100!r}"/><float name="far_clip" value="{place.unit * 100!r}"/>'
    return (f'<sensor type="orthographic">{clip}<transform name="to_world"><scale x="{size!r}" y="{size!r}"/>'
            f'<lookat origin="{place.position(b, 0, 4)}" target="{place.position(b, 0, 0)}" up="0, 1, 0"/></transform>{FILM}</sensor>')


def medium(place, sigma_t, albedo, g):
    return (f'<medium type="homogeneous" name="interior"><float name="sigma_t" value="{sigma_t / place.unit!r}"/>'
            f'<float name="albedo" value="{albedo!r}"/><phase type="hg"><float name="g" value="{g!r}"/></phase></medium>')


def boundary(n):
    return '<bsdf type="null"/>' if n == 1 else f'<bsdf type="dielectric"><float name="int_ior" value="{n!r}"/></bsdf>'


def light(radiance):
    return f'<emitter type="constant"><float name="radiance" value="{radiance!r}"/></emitter>'


def body(shape, n, sigma_t, albedo, g, b=0.0):
    return lambda place: (camera(place, b) + light(1.0) + f'<shape type="{shape}">' + place.transform() + boundary(n) +
                          medium(place, sigma_t, albedo, g) + "</shape>")


def diffuse(place):
    return (camera(place, 0.3) + light(1.0) + '<shape type="sphere">' + place.transform() +
            '<bsdf type="diffuse"><float name="reflectance" value="0.6"/></bsdf></shape>')


def exchange(larger_shines):
    """Irradiance of one rectangle by another through a ball of fog."""
    def scene(place):
        def rectangle(half, x, angle, inner):
            steps = (("scale", f'value="{half!r}"'), ("rotate", f'y="1" angle="{angle}"'), ("translate", f'x="{x}" z="0.4"'))
            return f'<shape type="rectangle">{place.transform(*steps)}{inner}</shape>'
        shine = '<emitter type="area"><float name="radiance" value="1"/></emitter>'
        measure = f'<sensor type="irradiancemeter">{FILM}</sensor>'
        black = '<bsdf type="diffuse"><float name="reflectance" value="0"/></bsdf>'
        first, second = (shine, measure) if larger_shines else (measure, shine)
        return (rectangle(0.5, -2, 90, black + first) + rectangle(0.3, 2.5, -90, black + second) + '<shape type="sphere">' +
                place.transform() + boundary(1) + medium(place, 1.0, 0.9, 0.5) + "</shape>")
    return scene


# name: scene, value
CASES = {
    "constant light": (lambda place: camera(place, 0) + light(0.7), 0.7),
    "white glass ball": (body("sphere", 1.5, 1.0, 1.0, 0.5), 1.0),
    "white cube of fog": (body("cube", 1.0, 3.0, 1.0, 0.0), 1.0),
    "white cube of glass": (body("cube", 1.5, 1.0, 1.0, 0.0), 1.0),
    "diffuse ball": (diffuse, 0.6),
    "absorbing ball": (body("sphere", 1.0, 2.0, 0.0, 0.0, 0.5), math.exp(-4 * math.sqrt(0.75))),
    "ball of fog": (body("sphere", 1.0, 2.0, 0.8, 0.0, 0.5), 0.565142633),
    "ball of fog, forward": (body("sphere", 1.0, 2.0, 0.9, 0.5, 0.25), 0.711352509),
    "glass ball of fog": (body("sphere", 1.5, 2.0, 0.8, 0.0, 0.5), 0.413666409),
    "glass ball, forward": (body("sphere", 1.33, 5.0, 0.95, 0.5, 0.5), 0.591454529),
}
# Flux from one rectangle to the other, both ways: irradiance times area.
EXCHANGED = "lamp and detector"


class Renderer:
    def __init__(self, itn, folder):
        self.itn, self.folder, self.runs = itn, pathlib.Path(folder), 0

    def __call__(self, scene, spp):
        """Mean and standard error; an error's text where it is refused."""
        self.runs += 1
        file = self.folder / "scene.xml"
        integrator = '<integrator type="volpath"><integer name="max_depth" value="-1"/></integrator>'
        file.write_text(f'<scene version="3.0.0">{integrator}{scene}</scene>')
        command = [self.itn, "render", str(file), "-o", str(self.folder / "image.exr"), "--spp", str(spp), "--seed", str(self.runs),
                   "--quiet", "--json", "-"]
        try:
            run = subprocess.run(command, capture_output=True, text=True, timeout=60 + spp / 20000)
        except subprocess.TimeoutExpired:
            return "no end"
        if run.returncode:
            return run.stderr.strip().splitlines()[-1] if run.stderr.strip() else f"exit code {run.returncode}"
        result = json.loads(run.stdout)
        return result["mean"][0], result["mean_stderr"][0]


class Table:
    def __init__(self):
        self.failures = 0

    def row(self, name, place, spp, found, expected, error_of_one=None):
        """error_of_one: standard error of one sample, as other runs say. Returns the one that this says."""
        start = f"{name:22} {spp:>9} samples, unit {place.unit:<7g} {place.away:>8g} away:"
        if isinstance(found, str):
            self.failures += 1
            print(f"{start} FAILED: {found}")
            return None
        value, error = found
        # Few samples may all miss what seldom happens, and then claim no error: they are judged by the one of many.
        expected_error = max(error, error_of_one / math.sqrt(spp) if error_of_one and spp < FEW else 0)
        rounding = ROUNDING * expected / LIMIT
        z = (value - expected) / math.hypot(expected_error, rounding)
        of_one = error * math.sqrt(spp)
        wrong = not abs(z) <= LIMIT
        note = ""
        if error_of_one and spp >= FEW and error > rounding and not 0.9 < of_one / error_of_one < 1.1:
            wrong, note = True, f"; the standard error should be {error_of_one / math.sqrt(spp):.2g}"
        self.failures += wrong
        print(f"{start} {value:.8f} +- {error:.1e}, exact {expected:.8f}, z {z:+.1f}{'  FAILED' if wrong else ''}{note}", flush=True)
        return of_one


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--itn", default=str(ROOT / "build/bin/itn"))
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    many = 1 << 20 if options.quick else 1 << 26
    units = (1e-6, 1.0, 1e6) if options.quick else (1e-6, 1e-3, 1.0, 1e3, 1e6)
    places = [Place(unit, away) for unit in units for away in (0.0, min(1e6, 9e11 / unit))]  # coordinates end at 1e12
    table = Table()
    with tempfile.TemporaryDirectory() as folder:
        render = Renderer(options.itn, folder)
        for name, (scene, expected) in CASES.items():
            if options.only not in name:
                continue
            of_one = None
            for place in places:
                found = table.row(name, place, FEW, render(scene(place), FEW), expected)
                if place.unit == 1 and place.away == 0:
                    of_one = found
                table.row(name, place, 64, render(scene(place), 64), expected, found)
            table.row(name, Place(), many, render(scene(Place()), many), expected, of_one)
        if options.only in EXCHANGED:
            for spp in (1 << 16, many):
                for place in places if spp < many else [Place()]:
                    one, other = render(exchange(True)(place), spp), render(exchange(False)(place), spp)
                    if isinstance(one, str) or isinstance(other, str):
                        table.row(EXCHANGED, place, spp, one if isinstance(one, str) else other, 0)
                        continue
                    # the meter's area, one way and the other
                    flux, back = [[x * 4 * half * half for x in of] for of, half in ((one, 0.3), (other, 0.5))]
                    table.row(EXCHANGED, place, spp, (flux[0], math.hypot(flux[1], back[1])), back[0])
    print(f"{table.failures} failed" if table.failures else "all as they should be")
    return 1 if table.failures else 0


if __name__ == "__main__":
    sys.exit(main())
