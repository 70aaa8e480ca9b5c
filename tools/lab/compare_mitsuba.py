#!/usr/bin/env python3
"""Renders scenes here and with Mitsuba 3, small, and compares the images' means. Needs Mitsuba (tools/peers).

    .peers/bin/python tools/lab/compare_mitsuba.py FOLDER --list FILE [--spp N] [--width W]

FILE names scenes, a path in FOLDER a line. Scenes that do not open here are left out (tools/lab/open_scenes.py tells why). Printed
are both means, a channel each, and their ratio; marked are those that differ by more than 1 % and five of our standard errors.
Exit code 1 where there are some. Few samples of rare, bright paths make both means wander: try --spp before you believe one.
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile

import mitsuba as mi
import numpy as np


def mean_of_mitsuba(scene, parameters, films, size, spp):
    for film in films:
        parameters[film] = size
    parameters.update()
    image = np.array(mi.render(scene, spp=spp, seed=1))
    return image[..., :3].reshape(-1, min(3, image.shape[2])).mean(0)


def mean_of_itn(itn, file, size, spp, folder):
    run = subprocess.run([itn, 'render', file, '--size', '%dx%d' % tuple(size), '--spp', str(spp), '--quiet', '-o',
                          os.path.join(folder, 'image.exr'), '--json', '-'], capture_output=True, text=True)
    if run.returncode:
        raise RuntimeError(run.stderr.strip())
    result = json.loads(run.stdout)
    return np.array(result['mean']), np.array(result['mean_stderr'])


def compare(options, file, folder):
    """True where the means agree."""
    scene = mi.load_file(file)
    parameters = mi.traverse(scene)
    films = [key for key in parameters.keys() if key.endswith('film.size')]
    width, height = (int(x) for x in np.array(parameters[films[0]]).ravel())
    scale = options.width / max(width, height)
    size = [max(8, round(width * scale)), max(8, round(height * scale))]
    theirs = mean_of_mitsuba(scene, parameters, films, size, options.spp)
    ours, error = mean_of_itn(options.itn, file, size, options.spp, folder)
    good = bool(np.all(np.abs(ours - theirs) < np.maximum(5 * error, 0.01 * theirs)))
    numbers = '  '.join(f'{a:.5f} / {b:.5f} = {a / max(b, 1e-9):.3f}' for a, b in zip(ours, theirs))
    print(f'{os.path.relpath(file, options.folder):70} {numbers}{"" if good else "  differs"}', flush=True)
    return good


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('folder', metavar='FOLDER')
    parser.add_argument('--list', required=True, metavar='FILE')
    parser.add_argument('--spp', type=int, default=256)
    parser.add_argument('--width', type=int, default=64, help='of the longer side [pixel]')
    parser.add_argument('--itn', default=os.path.join(os.path.dirname(__file__), '..', '..', 'build', 'bin', 'itn'))
    options = parser.parse_args()
    mi.set_variant(os.environ.get('MITSUBA_VARIANT', 'llvm_ad_rgb'))
    mi.set_log_level(mi.LogLevel.Error)
    agree, differ = 0, 0
    with open(options.list) as lines, tempfile.TemporaryDirectory() as folder:
        for line in lines:
            file = os.path.join(options.folder, line.strip())
            opened = subprocess.run([options.itn, 'parameters', file, '--quiet'], capture_output=True)
            if opened.returncode:
                continue
            try:
                good = compare(options, file, folder)
            except RuntimeError as error:
                print(f'{os.path.relpath(file, options.folder):70} not compared: {str(error).splitlines()[0]}')
                continue
            agree, differ = agree + good, differ + (not good)
    print(f'\n{agree} agree, {differ} differ')
    sys.exit(differ > 0)


if __name__ == '__main__':
    main()
