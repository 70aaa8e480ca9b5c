#!/usr/bin/env python3
"""Renders random scenes here and with Mitsuba 3 and compares them in blocks of pixels. Needs Mitsuba (tools/peers).

    .peers/bin/python tools/lab/random_scenes.py FOLDER [--first SEED] [--count N] [--itn build/bin/itn]

A scene has one or two bodies (spheres, cubes; index-matched, smooth, rough, masked, blended or opaque; filled with a medium or
with a grid of voxels, or empty; now and then something inside of them), one to three lights of all kinds, also inside of the
bodies, and perhaps a floor. 16 x 16 pixels, 2,048 samples each; the spread of Mitsuba's eight images is its error. Printed are
both means, their z-score and the largest of the 4 x 4 blocks' and three channels'; marked are means beyond 4.5 and blocks beyond
8, which is far for these, since the noise of rare paths is not normal. Exit code 1 where there are some. FOLDER keeps the scenes.
"""
import argparse
import array
import math
import os
import pathlib
import random
import struct
import subprocess
import sys

import mitsuba as mi
import numpy as np

VOXELS = 16
CAMERA = '''<sensor type="perspective"><float name="fov" value="36"/>
    <transform name="to_world"><lookat origin="0, -4.5, 1.2" target="0, 0, 0" up="0, 0, 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/><rfilter type="box"/></film></sensor>'''
OPAQUE = ['<bsdf type="diffuse"/>', '<bsdf type="plastic"/>', '<bsdf type="roughplastic"><float name="alpha" value="0.3"/></bsdf>',
          '<bsdf type="roughconductor"><float name="alpha" value="0.3"/></bsdf>']


def write_grid(file):
    n, middle = VOXELS, (VOXELS - 1) / 2
    values = [max(0, 1 - ((x - middle)**2 + (y - middle)**2 + (z - middle)**2) / 70) * (1 + 0.5 * math.sin(x + 2 * y))
              for z in range(n) for y in range(n) for x in range(n)]
    file.write_bytes(b'VOL\x03' + struct.pack('<5i6f', 1, n, n, n, 1, 0, 0, 0, 1, 1, 1) + array.array('f', values).tobytes())


class RandomScene:
    def __init__(self, seed):
        self.random = random.Random(seed)
        self.media, self.shapes, self.lights, self.hollow = [], [], [], []

    def text(self):
        depth = self.random.choice([6, 12, 24])
        for middle in self.random.choice([[(-0.6, 0, 0), (0.65, 0.1, 0.1)], [(0, 0, 0)]]):
            self.add_body(middle)
        for _ in range(self.random.choice([1, 1, 2, 3])):
            self.add_light()
        if self.random.random() < 0.6:
            self.shapes.append(f'''<shape type="rectangle"><transform name="to_world"><scale value="3"/><translate z="-1"/></transform>
    {self.random.choice(OPAQUE)}</shape>''')
        return '\n'.join(['<scene version="3.0.0">', f'<integrator type="volpath"><integer name="max_depth" value="{depth}"/></integrator>',
                          CAMERA, *self.media, *self.lights, *self.shapes, '</scene>\n'])

    def medium(self):
        name = f'medium_{len(self.media)}'
        albedo, sigma_t = self.random.choice([0.5, 0.8, 0.95, 1]), self.random.choice([0.5, 2, 5])
        phase = self.random.choice([f'<phase type="hg"><float name="g" value="{self.random.uniform(-0.5, 0.7):.3f}"/></phase>',
                                    '<phase type="isotropic"/>', '<phase type="rayleigh"/>'])
        if self.random.random() < 0.25:
            self.media.append(f'''<medium type="heterogeneous" id="{name}"><volume type="gridvolume" name="sigma_t">
    <string name="filename" value="grid.vol"/>
    <transform name="to_world"><scale value="3"/><translate x="-1.5" y="-1.5" z="-1.5"/></transform></volume>
    <float name="albedo" value="{albedo}"/><float name="scale" value="{sigma_t}"/>{phase}</medium>''')
        else:
            self.media.append(f'''<medium type="homogeneous" id="{name}"><float name="sigma_t" value="{sigma_t}"/>
    <rgb name="albedo" value="{albedo}, {0.9 * albedo}, {0.7 * albedo}"/>{phase}</medium>''')
        return name

    def boundary(self):
        rough = f'''<bsdf type="roughdielectric"><float name="alpha" value="{self.random.choice([0.2, 0.4, 0.6])}"/>
    <string name="distribution" value="{self.random.choice(['ggx', 'beckmann'])}"/><float name="int_ior" value="1.4"/></bsdf>'''
        masked = f'<bsdf type="mask"><float name="opacity" value="0.5"/>{self.random.choice([OPAQUE[0], rough])}</bsdf>'
        blended = f'<bsdf type="blendbsdf"><float name="weight" value="0.4"/>{OPAQUE[0]}<bsdf type="null"/></bsdf>'
        return self.random.choice(['<bsdf type="null"/>', '<bsdf type="dielectric"/>', rough, rough, masked, blended])

    @staticmethod
    def sphere(middle, radius, inner):
        x, y, z = middle
        return f'<shape type="sphere"><point name="center" value="{x:.4f}, {y:.4f}, {z:.4f}"/><float name="radius" value="{radius:.4f}"/>{inner}</shape>'

    @staticmethod
    def cube(middle, half, inner):
        x, y, z = middle
        return f'''<shape type="cube"><transform name="to_world"><scale value="{half}"/><rotate z="1" angle="30"/>
    <translate x="{x}" y="{y}" z="{z}"/></transform>{inner}</shape>'''

    def add_body(self, middle):
        radius = 0.9 if middle == (0, 0, 0) else 0.55
        if self.random.random() < 0.25:
            return self.shapes.append(self.sphere(middle, radius, self.random.choice(OPAQUE)))
        medium = self.medium() if self.random.random() < 0.85 else None
        within = f'<ref id="{medium}" name="exterior"/>' if medium else ''
        inner = self.boundary() + within.replace('exterior', 'interior')
        self.shapes.append(self.sphere(middle, radius, inner) if self.random.random() < 0.6 else self.cube(middle, 0.8 * radius, inner))
        if self.random.random() > 0.35:
            self.hollow.append((middle, radius, within))
        elif self.random.random() < 0.5:
            self.shapes.append(self.sphere(middle, 0.35 * radius, self.random.choice(OPAQUE) + within))
        else:
            self.shapes.append(self.sphere(middle, 0.4 * radius, f'{self.boundary()}{within}<ref id="{self.medium()}" name="interior"/>'))

    def add_light(self):
        kind = self.random.choice(['constant', 'envmap', 'point', 'spot', 'directional', 'projector', 'area', 'area', 'area', 'screen'])
        if kind in ('constant', 'envmap') and any('type="constant"' in light or 'type="envmap"' in light for light in self.lights):
            kind = 'area'
        place = [self.random.uniform(low, high) for low, high in ((-1.5, 1.5), (-2.5, -0.5), (0.9, 2.2))]
        radius, within = self.random.choice([0.1, 0.2, 0.4]), ''
        if self.hollow and self.random.random() < 0.3 and kind in ('point', 'spot', 'area'):
            (x, y, z), size, within = self.hollow.pop(self.random.randrange(len(self.hollow)))
            place, radius = (x + 0.1 * size, y - 0.4 * size, z + 0.1 * size), 0.12
        x, y, z = (f'{p:.4f}' for p in place)
        aimed = f'<transform name="to_world"><lookat origin="{x}, {y}, {z}" target="0, 0.3, -0.2" up="0, 0, 1"/></transform>'
        self.lights.append({
            'constant': '<emitter type="constant"><rgb name="radiance" value="0.3, 0.4, 0.5"/></emitter>',
            'envmap': '''<emitter type="envmap"><string name="filename" value="sky.exr"/>
    <transform name="to_world"><rotate x="1" angle="90"/></transform></emitter>''',
            'point': f'<emitter type="point"><point name="position" value="{x}, {y}, {z}"/><rgb name="intensity" value="2, 1.5, 1"/></emitter>',
            'spot': f'<emitter type="spot">{aimed}<rgb name="intensity" value="4, 3, 3"/><float name="cutoff_angle" value="35"/></emitter>',
            'directional': f'''<emitter type="directional"><vector name="direction" value="{x}, 0.5, -1"/>
    <rgb name="irradiance" value="2, 2, 1"/></emitter>''',
            'projector': f'<emitter type="projector">{aimed}<rgb name="irradiance" value="3, 3, 4"/><float name="fov" value="50"/></emitter>',
            'area': self.sphere(place, radius, f'''{within}<bsdf type="diffuse"/>
    <emitter type="area"><rgb name="radiance" value="8, 7, 6"/></emitter>'''),
            'screen': f'''<shape type="rectangle"><transform name="to_world"><scale value="0.4"/>
    <lookat origin="{x}, {y}, {z}" target="0, 0, 0" up="0, 0, 1"/></transform><emitter type="area"><rgb name="radiance" value="6, 6, 6"/></emitter></shape>''',
        }[kind])


def blocks(image):
    """Means of 4 x 4 pixels: (16, 16, 3) to (4, 4, 3)."""
    return image.reshape(4, 4, 4, 4, 3).mean((1, 3))


def by_itn(itn, file, image):
    """Mean and standard error of each pixel, (16, 16, 3)."""
    run = subprocess.run([itn, 'render', file, '--spp', '2048', '--seed', '5', '-o', image, '--quiet'], capture_output=True, text=True)
    if run.returncode:
        raise RuntimeError(run.stderr.strip())
    bitmap = mi.Bitmap(str(image))
    values = np.array(bitmap).astype(float)
    channel = {field.name: values[:, :, i] for i, field in enumerate(bitmap.struct_())}
    names = 'RGB' if 'R' in channel else 'YYY'
    return np.stack([channel[c] for c in names], -1), np.stack([channel[f'stderr.{c}'] for c in names], -1)


def compare(itn, file):
    """True where the images agree."""
    scene, passes = mi.load_file(str(file)), 8
    theirs = np.stack([np.array(mi.render(scene, spp=256, seed=k + 1))[:, :, :3] for k in range(passes)]).astype(float)
    ours, error = by_itn(itn, file, file.with_suffix('.exr'))
    of_blocks = np.stack([blocks(image) for image in theirs])
    variance = of_blocks.var(0, ddof=1) / passes + blocks(error**2) / 16
    z = (blocks(ours) - of_blocks.mean(0)) / np.sqrt(variance + (1e-4 * of_blocks.mean(0))**2 + 1e-12)
    means = theirs.mean((1, 2, 3))
    z_mean = (ours.mean() - means.mean()) / math.sqrt(means.var(ddof=1) / passes + (error.mean(-1)**2).mean() / 256 + 1e-14)
    good = abs(z_mean) < 4.5 and np.abs(z).max() < 8
    print(f'{file.name:14} {ours.mean():.4f} / {means.mean():.4f}  z {z_mean:+.1f}, blocks {np.abs(z).max():.1f}{"" if good else "  differs"}', flush=True)
    return good


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('folder', type=pathlib.Path, metavar='FOLDER')
    parser.add_argument('--first', type=int, default=0, metavar='SEED')
    parser.add_argument('--count', type=int, default=50, metavar='N')
    parser.add_argument('--itn', default='build/bin/itn')
    options = parser.parse_args()
    mi.set_variant(os.environ.get('MITSUBA_VARIANT', 'llvm_ad_rgb'))
    mi.set_log_level(mi.LogLevel.Error)
    options.folder.mkdir(parents=True, exist_ok=True)
    write_grid(options.folder / 'grid.vol')
    sky = pathlib.Path(__file__).parents[2] / 'scenes/test/mitsuba/sky.exr'
    (options.folder / 'sky.exr').write_bytes(sky.read_bytes())
    good = 0
    for seed in range(options.first, options.first + options.count):
        file = options.folder / f'scene_{seed}.xml'
        file.write_text(RandomScene(seed).text())
        good += compare(options.itn, file)
    print(f'{good} of {options.count} agree')
    return 0 if good == options.count else 1


sys.exit(main())
