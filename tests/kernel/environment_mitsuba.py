"""Prints environment_mitsuba.inc, radiance of emitters in Mitsuba 3 (3.9.1, variant scalar_rgb):

    python tests/kernel/environment_mitsuba.py > tests/kernel/environment_mitsuba.inc

Mitsuba computes 1 - cos(half angle of the sun) in single precision, which for the sun's own 0.27 degrees is 0.22 % off. It
cancels in the sun's irradiance (and where the aperture is the default one, in complex_sun); here apertures are such that it
does not show.
"""
import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")


def radiance(emitter, direction):
    si = mi.SurfaceInteraction3f()
    si.wi = -mi.Vector3f(*map(float, direction))
    return np.array(emitter.eval(si))


def numbers(values):
    return "{" + ", ".join(f"{float(v):.9g}" for v in np.ravel(values)) + "}"


def unit(v):
    return np.array(v) / np.linalg.norm(v)


def spherical(elevation, azimuth):
    e, a = np.radians([elevation, azimuth])
    return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])


generator = np.random.RandomState(1)
turned = mi.ScalarTransform4f().rotate((np.array([1, 2, 3]) / 14**0.5).tolist(), 77.0)
upright = mi.ScalarTransform4f()
mirrored = mi.ScalarTransform4f().rotate([1, 0, 0], 90.0).scale([-1, 1, 1])

print("// Made by environment_mitsuba.py.")
print("const RecordedSky recorded_skies[] = {")
for turbidity, albedo, elevation, aperture, complex_sun, to_world in [
    (3.0, [0.3, 0.3, 0.3], 60.0, 30.0, False, upright),
    (1.0, [0.0, 0.5, 1.0], 90.0, 30.0, False, turned),
    (10.0, [0.9, 0.2, 0.1], 0.5, 30.0, False, turned),
    (5.5, [0.1, 0.2, 0.3], 12.0, 0.5358, True, upright),
    (2.2, [0.1, 0.2, 0.3], 45.0, 0.5358, True, mirrored),
]:
    sun = spherical(elevation, 130.0)
    matrix = np.array(to_world.matrix)[:3, :3]
    world_sun = matrix @ sun
    emitter = mi.load_dict({
        "type": "sunsky", "turbidity": turbidity, "albedo": {"type": "rgb", "value": albedo},
        "sun_direction": world_sun.tolist(), "sun_aperture": aperture, "complex_sun": complex_sun,
        "sun_scale": 2.0, "sky_scale": 3.0, "to_world": to_world,
    })
    local = [[0, 0, 1], -sun, spherical(-5, 20), spherical(0.2, 20), spherical(2, 130), spherical(30, 310)]
    local += [unit(generator.normal(size=3) * [1, 1, 0] + [0, 0, abs(generator.normal())]) for _ in range(10)]
    for share in (0, 0.3, 0.5, 0.7):  # inside the sun's disc
        across = unit(np.cross(sun, generator.normal(size=3)))
        local.append(unit(sun + share * np.tan(np.radians(aperture) / 2) * across))
    print(f"    {{{turbidity}, {numbers(albedo)}, {numbers(world_sun)}, {aperture}, {str(complex_sun).lower()}, "
          f"{numbers(matrix)}, {{")
    for d in local:
        world = matrix @ unit(d)
        print(f"        {{{numbers(world)}, {numbers(radiance(emitter, world))}}},")
    print("    }},")
print("};")

width, height = 5, 4
pixels = (np.arange(width * height * 3, dtype=np.float32) * 7 % 11).reshape(height, width, 3)
print("// bitmap: value i * 7 mod 11 at float i")
print("const RecordedMap recorded_maps[] = {")
for to_world in (upright, turned, mirrored):
    emitter = mi.load_dict({"type": "envmap", "bitmap": mi.Bitmap(pixels), "scale": 1.5, "to_world": to_world})
    matrix = np.array(to_world.matrix)[:3, :3]
    print(f"    {{{numbers(matrix)}, {{")
    poles = [[0, 1, 0], [0, -1, 0]] if to_world is upright else []  # elsewhere rounding decides on the azimuth there
    for d in poles + [[1, 0, 0], [0, 0, 1], [0, 0, -1]] + [generator.normal(size=3) for _ in range(10)]:
        world = matrix @ unit(d)
        print(f"        {{{numbers(world)}, {numbers(radiance(emitter, world))}}},")
    print("    }},")
print("};")
