"""Writes the grids of voxels of scenes/test/mitsuba and scenes/gallery, in Mitsuba's .vol format, version 3.

    python3 scenes/make_grids.py        # needs nothing but Python

The files are committed; run this only to change them.
"""
import array
import math
import os
import random
import struct
import sys

HERE = os.path.dirname(os.path.abspath(__file__))


def write(name, size, value, box=(0, 0, 0, 1, 1, 1)):
    """value(x, y, z) at the centres of voxels in the unit cube: a number, or three."""
    nx, ny, nz = size
    data = array.array('f')
    for k in range(nz):
        for j in range(ny):
            for i in range(nx):
                v = value((i + 0.5) / nx, (j + 0.5) / ny, (k + 0.5) / nz)
                data.extend(v if isinstance(v, tuple) else (v,))
    if sys.byteorder == 'big':
        data.byteswap()
    path = os.path.join(HERE, name)
    with open(path, 'wb') as f:
        f.write(b'VOL' + struct.pack('<B5i6f', 3, 1, nx, ny, nz, len(data) // (nx * ny * nz), *box))
        data.tofile(f)
    print(path, os.path.getsize(path), 'bytes')


def waves(x, y, z):
    """From 0, on a third of the volume, to 1."""
    return max(0.0, math.sin(9 * x + 4 * y) * math.cos(7 * z + 2 * x) + 0.3) / 1.3


def coloured_waves(x, y, z):
    return waves(x, y, z), 0.2 + 0.5 * waves(y, z, x), 0.6 * waves(z, x, y)


def tints(x, y, z):
    """Albedos."""
    return 0.95 - 0.3 * x, 0.9 - 0.6 * y * z, 0.5 + 0.4 * math.sin(6 * z) ** 2


def layered(skin, fat, bone):
    """From the top: 0.3, 0.5 and 0.2 of the height."""
    return lambda x, y, z: skin if z > 0.7 else fat if z > 0.2 else bone


class Noise:
    """Gradient noise of a lattice (Perlin 2002), of mean 0."""

    def __init__(self, seed):
        self.order = list(range(256))
        random.Random(seed).shuffle(self.order)

    def gradient(self, i, j, k, x, y, z):
        h = self.order[(self.order[(self.order[i & 255] + j) & 255] + k) & 255] & 15
        u, v = (x if h < 8 else y), (y if h < 4 else x if h in (12, 14) else z)
        return (u if h & 1 == 0 else -u) + (v if h & 2 == 0 else -v)

    def __call__(self, x, y, z):
        i, j, k = math.floor(x), math.floor(y), math.floor(z)
        x, y, z = x - i, y - j, z - k
        u, v, w = (t * t * t * (t * (6 * t - 15) + 10) for t in (x, y, z))
        total = 0.0
        for a in (0, 1):
            for b in (0, 1):
                for c in (0, 1):
                    share = (u if a else 1 - u) * (v if b else 1 - v) * (w if c else 1 - w)
                    total += share * self.gradient(i + a, j + b, k + c, x - a, y - b, z - c)
        return total


def cloud(seed):
    """A heap of cumulus: balls whose surface octaves of noise move; flat below."""
    noise, rng = Noise(seed), random.Random(seed)
    balls = [((0.5, 0.5, 0.4), 0.26)]
    for _ in range(9):
        angle, away = 2 * math.pi * rng.random(), 0.12 + 0.2 * rng.random()
        balls.append(((0.5 + away * math.cos(angle), 0.5 + away * math.sin(angle), 0.3 + 0.25 * rng.random()),
                      0.1 + 0.08 * rng.random()))

    def density(x, y, z):
        depth = max(radius - math.dist((x, y, z), centre) for centre, radius in balls)
        rough = sum(0.055 / 2**o * noise(5 * 2**o * x, 5 * 2**o * y, 5 * 2**o * z) for o in range(4))
        below = (z - 0.2) / 0.06
        return max(0.0, min(1.0, 14 * (depth + rough))) * max(0.0, min(1.0, below))

    return density


def marble(seed):
    """Albedos: veins where waves that noise bends pass 0."""
    noise = Noise(seed)

    def albedo(x, y, z):
        bent = sum(noise(3 * 2**o * x, 3 * 2**o * y, 3 * 2**o * z) / 2**o for o in range(4))
        vein = abs(math.sin(5 * (x + 0.6 * y + 0.8 * z) + 3 * bent))
        return 0.998 - 0.6 * (1 - vein) ** 4

    return albedo


def main():
    write('test/layers.vol', (1, 1, 10), layered(4, 1, 10))
    write('test/layers_albedo.vol', (1, 1, 10), layered(0.9, 0.6, 0.98))
    write('test/mitsuba/waves.vol', (12, 10, 14), waves, (-0.9, -0.8, -0.7, 0.8, 0.9, 1))
    write('test/mitsuba/waves_rgb.vol', (9, 11, 8), coloured_waves)
    write('test/mitsuba/tints.vol', (5, 6, 7), tints, (-1, -1, -1, 1, 1, 1))
    write('gallery/cloud.vol', (48, 48, 30), cloud(5))
    write('gallery/marble.vol', (40, 40, 40), marble(9))


if __name__ == '__main__':
    main()
