#!/usr/bin/env python3
"""Renders small scenes of all models, 4 x 4 pixels, with every number at 0, denormal, 1e-38 ... 1e38 of either sign, one at a time;
what `itn parameters` lists within the range that it says, and at its ends.

  tools/lab/extreme_parameters.py [--itn build/bin/itn] [--scenes a,b] [--quick | --once] [--oclgrind] [--derivatives]
                              [--spp N] [--size 4x4] [--timeout S]

Each run must end within the time, with an image of finite values from 0 on, or be refused with a message (exit code 3). In
white furnaces (names that begin with furnace) the image must be 1, or the warning must say that it is not to be trusted. Exit code
1 where something else happens."""
import argparse
import collections
import json
import math
import os
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]

# {name=value} is a number: it becomes $name, and a default of the scene. The name is that of `itn parameters`, with _ for each dot,
# where it is listed there.
CAMERA = """<sensor type="perspective"><float name="fov" value="30"/>
    <transform name="to_world"><lookat origin="0, -5, 2" target="0, 0, 0" up="0, 0, 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/><rfilter type="box"/></film>
    <sampler type="independent"><integer name="sample_count" value="16"/></sampler></sensor>"""
SKY = '<emitter type="constant" id="sky"><rgb name="radiance" value="{sky_radiance_R=1}, {sky_radiance_G=0.9}, {sky_radiance_B=0.8}"/></emitter>'
WHITE = '<emitter type="constant"/>'


def ball(x, bsdf, rest=""):
    return f'<shape type="sphere"><point name="center" x="{x}" y="0" z="0"/><float name="radius" value="0.6"/>{bsdf}{rest}</shape>'


def bsdf(kind, name, *properties):
    return f'<bsdf type="{kind}" id="{name}">{"".join(properties)}</bsdf>'


def number(of, name, value):
    return f'<float name="{name}" value="{{{of}_{name}={value}}}"/>'


def colour(of, name, r, g, b):
    return f'<rgb name="{name}" value="{{{of}_{name}_R={r}}}, {{{of}_{name}_G={g}}}, {{{of}_{name}_B={b}}}"/>'


def medium(kind, name, phase, *properties):
    return f'<medium type="{kind}" name="interior" id="{name}">{"".join(properties)}{phase}</medium>'


def hg(name="haze", g=0.5):
    return f'<phase type="hg" id="{name}">{number(name, "g", g)}</phase>'


NULL = '<bsdf type="null"/>'
GRID = '<volume name="sigma_t" type="gridvolume"><string name="filename" value="grid.vol"/>' \
       '<transform name="to_world"><translate x="-0.5" y="-0.5" z="-0.5"/></transform></volume>'
PACKED = GRID.replace("grid.vol", "bricks.vol").replace("<transform", '<integer name="bits" value="8"/><transform')
CUBE = '<shape type="cube"><transform name="to_world"><scale value="0.5"/></transform>'
PHASES = '<phase type="dictionary" id="parts"><string name="weights" value="{parts_weight_0=1}, {parts_weight_1=2}, ' \
         '{parts_weight_2=1}, {parts_weight_3=1}"/>' + hg() + \
         '<phase type="vmf" id="peak">' + number("peak", "kappa", 3) + '</phase>' \
         '<phase type="draine" id="dust">' + number("dust", "g", 0.3) + number("dust", "alpha", 1) + '</phase>' \
         '<phase type="rayleigh"/></phase>'


def white(name):
    return medium("homogeneous", name, hg(), number(name, "sigma_t", 3), '<float name="albedo" value="1"/>', number(name, "scale", 1))


SCENES = {
    "furnace_matched": WHITE + ball(0, NULL, white("milk")),
    "furnace_glass": WHITE + ball(0, bsdf("dielectric", "glass", number("glass", "int_ior", 1.5), number("glass", "ext_ior", 1)), white("milk")),
    "furnace_phases": WHITE + ball(0, NULL, medium("homogeneous", "milk", PHASES, number("milk", "sigma_t", 3), '<float name="albedo" value="1"/>', number("milk", "scale", 1))),
    "furnace_grid": WHITE + CUBE + NULL + medium("heterogeneous", "cloud", hg(), GRID, '<float name="albedo" value="1"/>', number("cloud", "scale", 4)) + "</shape>",
    "media": SKY + ball(-0.9, bsdf("roughdielectric", "frosted", number("frosted", "alpha", 0.2), number("frosted", "int_ior", 1.5), number("frosted", "ext_ior", 1)),
                        medium("homogeneous", "skin", hg(), colour("skin", "sigma_t", 5, 8, 12), colour("skin", "albedo", 0.9, 0.8, 0.7), number("skin", "scale", 1)))
    + ball(0.9, NULL, medium("homogeneous", "wax", '<phase type="isotropic"/>', colour("wax", "sigma_s", 3, 4, 5), colour("wax", "sigma_a", 0.1, 0.2, 0.3))),
    "grid": SKY + CUBE + NULL + medium("heterogeneous", "cloud", hg(), GRID, colour("cloud", "albedo", 0.9, 0.8, 0.7), number("cloud", "scale", 4)) + "</shape>",
    "packed": SKY + CUBE + NULL + medium("heterogeneous", "cloud", hg(), PACKED, number("cloud", "albedo", 0.9), number("cloud", "scale", 4)) + "</shape>",
    "metals": SKY + ball(-1.2, bsdf("roughconductor", "gold", number("gold", "alpha", 0.2), colour("gold", "eta", 0.2, 0.4, 1.4), colour("gold", "k", 3.9, 2.4, 1.6), number("gold", "specular_reflectance", 1)))
    + ball(0, bsdf("conductor", "mirror", colour("mirror", "eta", 0.2, 0.4, 1.4), colour("mirror", "k", 3.9, 2.4, 1.6), number("mirror", "specular_reflectance", 1)))
    + ball(1.2, bsdf("roughconductor", "brushed", number("brushed", "alpha_u", 0.1), number("brushed", "alpha_v", 0.3), number("brushed", "eta", 0.2), number("brushed", "k", 3), number("brushed", "specular_reflectance", 0.9))),
    "coated": SKY + ball(-1.2, bsdf("plastic", "toy", colour("toy", "diffuse_reflectance", 0.5, 0.3, 0.2), number("toy", "specular_reflectance", 1), number("toy", "int_ior", 1.5), number("toy", "ext_ior", 1)))
    + ball(0, bsdf("roughplastic", "tile", colour("tile", "diffuse_reflectance", 0.5, 0.3, 0.2), number("tile", "specular_reflectance", 1), number("tile", "alpha", 0.2), number("tile", "int_ior", 1.5), number("tile", "ext_ior", 1)))
    + ball(1.2, bsdf("pplastic", "film", number("film", "diffuse_reflectance", 0.5), number("film", "specular_reflectance", 1), number("film", "alpha", 0.2), number("film", "int_ior", 1.5), number("film", "ext_ior", 1))),
    "glass": SKY + ball(-1.2, bsdf("dielectric", "clear", number("clear", "int_ior", 1.5), number("clear", "ext_ior", 1), number("clear", "specular_reflectance", 1), number("clear", "specular_transmittance", 1)))
    + ball(0, bsdf("thindielectric", "pane", number("pane", "int_ior", 1.5), number("pane", "ext_ior", 1), number("pane", "specular_reflectance", 1), number("pane", "specular_transmittance", 1)))
    + ball(1.2, bsdf("roughdielectric", "etched", number("etched", "alpha_u", 0.1), number("etched", "alpha_v", 0.3), number("etched", "int_ior", 1.5), number("etched", "ext_ior", 1)))
    + '<shape type="rectangle"><transform name="to_world"><translate z="-1"/></transform>' + bsdf("polarizer", "filter", number("filter", "transmittance", 1)) + '</shape>',
    "lobes": SKY + ball(-1.2, bsdf("oren_nayar", "clay", colour("clay", "reflectance", 0.5, 0.4, 0.3), number("clay", "alpha", 0.4)))
    + ball(0, bsdf("ward", "satin", number("satin", "diffuse_reflectance", 0.3), number("satin", "specular_reflectance", 0.3), number("satin", "alpha_u", 0.1), number("satin", "alpha_v", 0.3)))
    + ball(1.2, bsdf("ashikhmin_shirley", "paint", number("paint", "diffuse_reflectance", 0.3), number("paint", "specular_reflectance", 0.3), number("paint", "nu", 30), number("paint", "nv", 100))),
    "principled": SKY + ball(-1.2, bsdf("principled", "car", colour("car", "base_color", 0.5, 0.4, 0.3), *[number("car", n, v) for n, v in (
        ("roughness", 0.4), ("anisotropic", 0.3), ("metallic", 0.3), ("spec_tint", 0.3), ("sheen", 0.3), ("sheen_tint", 0.3), ("flatness", 0.3), ("clearcoat", 0.5), ("clearcoat_gloss", 0.5), ("eta", 1.5))]))
    + ball(0, bsdf("principled", "ice", number("ice", "base_color", 0.8), number("ice", "roughness", 0.3), number("ice", "spec_trans", 0.7), number("ice", "eta", 1.4)))
    + ball(1.2, bsdf("principledthin", "leaf", number("leaf", "base_color", 0.8), *[number("leaf", n, v) for n, v in (
        ("roughness", 0.3), ("anisotropic", 0.3), ("spec_trans", 0.3), ("spec_tint", 0.3), ("sheen", 0.3), ("sheen_tint", 0.3), ("flatness", 0.3), ("diff_trans", 0.6), ("eta", 1.4))])),
    "nests": SKY + ball(-1.2, bsdf("twosided", "both", bsdf("blendbsdf", "mix", number("mix", "weight", 0.4), bsdf("diffuse", "red", colour("red", "reflectance", 0.8, 0.2, 0.1)), bsdf("roughconductor", "steel", number("steel", "alpha", 0.3)))))
    + ball(0, bsdf("mask", "lace", number("lace", "opacity", 0.6), bsdf("diffuse", "blue", colour("blue", "reflectance", 0.1, 0.2, 0.8))))
    + ball(1.2, bsdf("dictionary", "worn", '<string name="weights" value="{worn_weight_0=1}, {worn_weight_1=2}"/>', bsdf("diffuse", "base", '<texture type="checkerboard" name="reflectance" id="squares">' + colour("squares", "color0", 0.4, 0.5, 0.6) + colour("squares", "color1", 0.2, 0.1, 0.3) + '</texture>'), bsdf("plastic", "gloss"))),
    "lights": '<emitter type="point" id="bulb"><point name="position" x="0" y="-2" z="3"/>' + colour("bulb", "intensity", 6, 5, 4) + '</emitter>'
    + '<emitter type="spot" id="torch"><transform name="to_world"><lookat origin="2, -2, 3" target="0, 0, 0" up="0, 0, 1"/></transform>' + colour("torch", "intensity", 6, 5, 4) + '</emitter>'
    + '<emitter type="directional" id="far"><vector name="direction" x="0.2" y="1" z="-1"/>' + colour("far", "irradiance", 1, 2, 3) + '</emitter>'
    + '<emitter type="projector" id="slide"><transform name="to_world"><lookat origin="-2, -2, 3" target="0, 0, 0" up="0, 0, 1"/></transform>' + number("slide", "irradiance", 1) + number("slide", "scale", 1) + '</emitter>'
    + '<shape type="sphere"><point name="center" x="0" y="0" z="2.5"/><float name="radius" value="0.2"/><emitter type="area" id="lamp">' + colour("lamp", "radiance", 9, 8, 7) + '</emitter></shape>'
    + ball(-0.7, bsdf("diffuse", "chalk", number("chalk", "reflectance", 0.7))) + ball(0.7, NULL, medium("homogeneous", "fog", hg(), number("fog", "sigma_t", 3), number("fog", "albedo", 0.8))),
    "sunsky": '<emitter type="sunsky" id="day"><vector name="sun_direction" x="0.3" y="-0.4" z="0.8"/>' + "".join(number("day", n, v) for n, v in (
        ("turbidity", 3), ("albedo", 0.3), ("sun_scale", 1), ("sky_scale", 1))) + '</emitter>' + ball(0, bsdf("diffuse", "chalk", number("chalk", "reflectance", 0.7))),
    "harmonics": '<emitter type="sphericalharmonics" id="dome">' + "".join(f'<rgb name="{n}" value="{{dome_{n}={v}}}"/>' for n, v in (("c_0_0", 3), ("c_1_0", 0.3))) + '</emitter>'
    + ball(0, bsdf("diffuse", "chalk", number("chalk", "reflectance", 0.7))),
}

VALUES = [sign * v for v in (0.0, 1e-45, 1e-40, 1e-38, 1e-30, 1e-20, 1e-10, 1e-5, 1e5, 1e10, 1e20, 1e30, 1e38) for sign in (1, -1)][1:]
QUICK = [0.0, 1e-40, 1e-10, 1e10, 1e30, -1e10]


def text_of(body):
    """A scene, and the values that its numbers have by themselves."""
    defaults = {}

    def named(match):
        defaults[match[1]] = match[2]
        return f"${match[1]}"

    body = re.sub(r"\{(\w+)=([^}]*)\}", named, body)
    lines = "".join(f'<default name="{n}" value="{v}"/>' for n, v in defaults.items())
    return f'<scene version="3.0.0">{lines}<integrator type="volpath"/>{CAMERA}{body}</scene>', defaults


def write_grid(path, size, values):
    path.write_bytes(b"VOL\x03" + struct.pack("<5i6f", 1, size, size, size, 1, 0, 0, 0, 1, 1, 1) + struct.pack(f"<{len(values)}f", *values))


# Inlined by force, kernels hold hints of the compiler that Oclgrind 21.10 does not know. What no path reads counts as not
# initialised, too: a stage loads and stores all fields of a slot.
OCLGRIND = ["oclgrind", "--data-races", "--max-errors", "20", "--global-mem-size", "2000000000",
            "--build-options", "-cl-opt-disable -Dalways_inline=unused", "--log", "oclgrind.txt"]


NOT_LISTED = {"low": None, "high": None, "range": "(-inf, inf)", "differentiable": False}  # fixed once a scene is loaded


def candidates(parameter, values):
    low, high = (math.inf * s if parameter[k] is None else parameter[k] for k, s in (("low", -1), ("high", 1)))
    opened, closed = parameter["range"][0] == "(", parameter["range"][-1] == ")"
    within = [v for v in values if (low < v or (low == v and not opened)) and (v < high or (v == high and not closed))]
    ends = []
    for end, is_open, towards in ((low, opened, 1), (high, closed, -1)):
        if math.isfinite(end):
            ends.append(end + towards * max(abs(end), 1e-3) * 1e-6 if is_open else end)
    return sorted(set(within + ends))


class Checker:
    def __init__(self, options, work):
        self.options, self.work = options, work
        self.command = [*(OCLGRIND if options.oclgrind else []), str(options.itn.resolve())]
        self.environment = os.environ | ({"ITN_DEVICE": "oclgrind"} if options.oclgrind else {})
        self.log = work / "oclgrind.txt"
        self.counts, self.failures, self.slowest = collections.Counter(), [], (0, "")

    def run(self, arguments):
        start = time.monotonic()
        try:
            done = subprocess.run(self.command + arguments, capture_output=True, text=True, timeout=self.options.timeout, cwd=self.work,
                                  env=self.environment)
        except subprocess.TimeoutExpired:
            return None, time.monotonic() - start
        return done, time.monotonic() - start

    def parameters(self, scene):
        done, _ = self.run(["parameters", scene, "--json", "-", "--quiet"])
        if done is None or done.returncode:
            sys.exit(f"{scene}: {done and done.stderr}")
        return [p for p in json.loads(done.stdout)["parameters"] if p["value"] is not None]

    def verdict(self, scene, done):
        """What is wrong with a run; None: nothing."""
        if done is None:
            return f"more than {self.options.timeout:.0f} s"
        if self.log.exists() and self.log.read_text().strip():
            return "Oclgrind: " + self.log.read_text()[:2000]
        if done.returncode == 3 and done.stderr.strip():
            self.counts["refused"] += 1
            return None
        if done.returncode:
            return f"exit code {done.returncode}: {done.stderr.strip()[-400:]}"
        result = json.loads(done.stdout)
        found = [result["mean"], result["mean_stderr"]] + [d[k] for d in result["derivatives"].values() for k in ("mean", "stderr")]
        if any(v is None or not math.isfinite(v) for values in found for v in values):
            return f"not finite: {found}"
        if min(result["mean"]) < 0 and scene != "harmonics":
            return f"below 0: {result['mean']}"
        self.counts["rendered"] += 1
        if scene.startswith("furnace"):
            mean, error = result["mean"][0], result["mean_stderr"][0]
            told = "too dark" in done.stderr or "found light" in done.stderr
            self.counts["furnaces"] += 1
            self.counts["furnaces with a warning"] += told
            if abs(mean - 1) > 5 * error + 1e-4 and not told:
                return f"furnace: {mean} +- {error}"
        return None

    def render(self, scene, what, more):
        arguments = ["render", f"{scene}.xml", "-o", f"{scene}.exr", "--json", "-", *more]  # warnings are part of the verdict
        if self.options.size:
            arguments += ["--size", self.options.size]
        if self.options.spp:
            arguments += ["--spp", str(self.options.spp)]
        done, seconds = self.run(arguments)
        self.counts["runs"] += 1
        self.slowest = max(self.slowest, (seconds, f"{scene}: {what}"))
        wrong = self.verdict(scene, done)
        if wrong:
            self.failures.append(f"{scene}: {what}")
            print(f"{scene}: {what}: {wrong}", flush=True)

    def check(self, scene, body):
        text, defaults = text_of(body)
        path = self.work / f"{scene}.xml"
        path.write_text(text)
        listed = {p["name"].replace(".", "_"): p for p in self.parameters(path.name)}
        for variable in [] if self.options.once else defaults:
            parameter = listed.get(variable, NOT_LISTED)
            derivative = ["--derivative", parameter["name"]] if self.options.derivatives and parameter["differentiable"] else []
            for value in candidates(parameter, QUICK if self.options.quick else VALUES):
                self.render(scene, f"{variable} = {value!r}", ["-D", f"{variable}={value!r}", *derivative])
        if self.options.once:
            self.render(scene, "as it is", [])
        of_these = len(listed.keys() & defaults.keys())
        print(f"{scene}: {len(defaults)} numbers, {of_these} of them parameters", flush=True)
        self.counts["numbers"] += len(defaults)
        self.counts["parameters"] += of_these


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--itn", default=ROOT / "build/bin/itn", type=pathlib.Path)
    parser.add_argument("--oclgrind", action="store_true", help="under Oclgrind, which checks the kernels' memory")
    parser.add_argument("--scenes", default=",".join(SCENES))
    parser.add_argument("--derivatives", action="store_true", help="with the derivative by the parameter that is changed")
    parser.add_argument("--quick", action="store_true", help="six values and the ends in place of 25")
    parser.add_argument("--once", action="store_true", help="each scene as it is, no values")
    parser.add_argument("--spp", type=int, default=0)
    parser.add_argument("--size", help="WIDTHxHEIGHT; default: 4x4")
    parser.add_argument("--timeout", type=float, default=120, help="[s]")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="itn_extreme_") as folder:
        work = pathlib.Path(folder)
        write_grid(work / "grid.vol", 4, [1.0] * 4**3)
        write_grid(work / "bricks.vol", 12, [min(1.0, k % 12 % 7 / 6 + (k % 12 < 8)) for k in range(12**3)])  # even bricks, and others
        checker = Checker(options, work)
        for scene in options.scenes.split(","):
            checker.check(scene, SCENES[scene])
    print(", ".join(f"{n} {what}" for what, n in checker.counts.items()) + f"; the slowest {checker.slowest[0]:.1f} s: {checker.slowest[1]}")
    print(f"{len(checker.failures)} failures")
    sys.exit(1 if checker.failures else 0)


main()
