#!/usr/bin/env python3
"""Derivatives by single voxels, empty and densest, here and by Mitsuba's prbvolpath, beside finite differences. Needs Mitsuba (tools/peers).

    .peers/bin/python tools/lab/voxel_bias_mitsuba.py FOLDER [--itn build/bin/itn] [--spp 16384] [--runs 8]

A cube of 3 x 3 x 3 voxels in a sky and a lamp: one corner is empty, one is the densest, one between. The derivative is that of the
mean squared radiance of 8 x 8 pixels. Finite differences are of itn's losses with the same random numbers, of second order,
one-sided at 0 and at the greatest value. Printed with standard errors from the runs' spread, and z against the differences.
"""
import argparse
import array
import json
import math
import pathlib
import struct
import subprocess

import drjit as dr
import mitsuba as mi
import numpy as np

VOXELS = {'empty': (0, 0.0), 'between': (13, 1.0), 'densest': (26, 3.0)}
GRID = [0.6 + 0.3 * ((7 * k) % 5) for k in range(27)]
for at, value in VOXELS.values():
    GRID[at] = value
SCENE = '''<scene version="3.0.0">
  <integrator type="volpath"><integer name="max_depth" value="24"/></integrator>
  <sensor type="perspective"><float name="fov" value="34"/>
    <transform name="to_world"><lookat origin="0, -4.5, 1.5" target="0, 0, 0" up="0, 0, 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/><rfilter type="box"/></film></sensor>
  <emitter type="constant"><float name="radiance" value="0.5"/></emitter>
  <emitter type="directional"><vector name="direction" value="0.6, 0.5, -0.7"/><float name="irradiance" value="3"/></emitter>
  <shape type="cube">BOUNDARY
    <medium name="interior" type="heterogeneous" id="smoke">
      <volume type="gridvolume" name="sigma_t"><string name="filename" value="GRID"/>
        <transform name="to_world"><scale value="2"/><translate x="-1" y="-1" z="-1"/></transform></volume>
      <float name="albedo" value="0.8"/></medium></shape>
</scene>'''
BOUNDARIES = {'index-matched': '<bsdf type="null"/>', 'rough': '<bsdf type="roughdielectric"><float name="alpha" value="0.5"/></bsdf>'}


def write_scene(folder, boundary, values):
    (folder / 'grid.vol').write_bytes(b'VOL\x03' + struct.pack('<5i6f', 1, 3, 3, 3, 1, 0, 0, 0, 1, 1, 1) + array.array('f', values).tobytes())
    (folder / 'scene.xml').write_text(SCENE.replace('BOUNDARY', boundary).replace('GRID', 'grid.vol'))


def by_itn(options, seed, parameter):
    run = subprocess.run([options.itn, 'gradient', options.folder / 'scene.xml', '--target', options.folder / 'black.exr', '--spp', str(options.spp), '--seed',
                          str(seed), '--parameter', parameter, '-o', options.folder, '--quiet', '--json', '-'], check=True, capture_output=True, text=True)
    return json.loads(run.stdout)


def difference(options, boundary, at, seed):
    """Of the loss, of second order: central, or one-sided where a step on would leave what the grid's other values span."""
    step, value = 0.25, GRID[at]
    weights = {0: -1.5, 1: 2, 2: -0.5} if value == 0 else {0: 1.5, -1: -2, -2: 0.5} if value == max(GRID) else {1: 0.5, -1: -0.5}
    sum_ = 0
    for k, weight in weights.items():
        moved = list(GRID)
        moved[at] = value + k * step
        write_scene(options.folder, boundary, moved)
        sum_ += weight * by_itn(options, seed, 'smoke.albedo')['loss'] / step
    return sum_


def voxels_by_itn(options, seed):
    by_itn(options, seed, 'smoke.sigma_t')
    return np.frombuffer((options.folder / 'gradient.smoke.sigma_t.vol').read_bytes()[48:], np.float32).astype(float)


def voxels_by_mitsuba(options, seed):
    scene = mi.load_file(str(options.folder / 'scene.xml'))
    parameters = mi.traverse(scene)
    key, = [k for k in parameters.keys() if k.endswith('.sigma_t.data')]
    dr.enable_grad(parameters[key])
    parameters.update()
    integrator = mi.load_dict({'type': 'prbvolpath', 'max_depth': 24})
    image = mi.render(scene, parameters, integrator=integrator, spp=options.spp, seed=2 * seed, seed_grad=2 * seed + 1)
    dr.backward(dr.mean(dr.square(image), axis=None))
    return np.array(dr.grad(parameters[key])).ravel().astype(float)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('folder', type=pathlib.Path, metavar='FOLDER')
    parser.add_argument('--itn', default='build/bin/itn')
    parser.add_argument('--spp', type=int, default=16384)
    parser.add_argument('--runs', type=int, default=8)
    options = parser.parse_args()
    mi.set_variant('llvm_ad_rgb')
    mi.set_log_level(mi.LogLevel.Error)
    options.folder.mkdir(parents=True, exist_ok=True)
    mi.Bitmap(np.zeros((8, 8, 3), np.float32)).write(str(options.folder / 'black.exr'))
    mean = lambda rows: (np.mean(rows, 0), np.std(rows, 0, ddof=1) / math.sqrt(len(rows)))
    for name, boundary in BOUNDARIES.items():
        write_scene(options.folder, boundary, GRID)
        ours = mean([voxels_by_itn(options, seed) for seed in range(options.runs)])
        theirs = mean([voxels_by_mitsuba(options, seed) for seed in range(options.runs)])
        for voxel, (at, _) in VOXELS.items():
            exact = mean([difference(options, boundary, at, 100 + seed) for seed in range(options.runs)])
            z = [(x[0][at] - exact[0]) / math.hypot(x[1][at], exact[1]) for x in (ours, theirs)]
            print(f'{name:14} {voxel:8} differences {1e3 * exact[0]:.4f} +- {1e3 * exact[1]:.4f}   itn {1e3 * ours[0][at]:.4f} +- {1e3 * ours[1][at]:.4f} z {z[0]:+.1f}'
                  f'   prbvolpath {1e3 * theirs[0][at]:.4f} +- {1e3 * theirs[1][at]:.4f} z {z[1]:+.1f}   [1e-3]', flush=True)


main()
