#!/usr/bin/env python3
"""What a network gains from being shown the scene (itn predict --exemplars).

    tools/lab/shown_network.py [DIR] -o OUT [--exemplars 24] [--alone N] [--run shipped] [--spp N] [--itn build/bin/itn]

With DIR, a data set (itn dataset laptop, say): every test image of split unseen_both under a sun. Without: six shapes whose
boundary is rough (Beckmann, alpha 0.25, n = 1.33), each seen from elsewhere under its own sun, 16 materials each: scenes as
the network that ships with itn has not seen any. OUT gets what is rendered; nothing that is there is rendered again. Photos of
a scene share its exemplars, or with --alone so many of them are taken, evenly, each with exemplars of its own.

Prints for the network as it is and for the one that is shown each scene: root mean square and median errors, how many of its
95 % intervals hold the truth, and how many of these photos, which are all right, its judge doubts, or the exemplars do.
"""
import argparse
import json
import math
import pathlib
import random
import statistics
import subprocess
import sys

from invert_dataset import cpu_seconds, evenly, mesh_of, parameters, root, scene_file

sun_height = math.sqrt(0.75)  # zenith 30 degrees
views = [('knot', 15, '14, -26, 20'), ('cup', 40, '-20, -20, 20'), ('hand', 65, '0, -30, 15'), ('sponge', 30, '20, -10, 30'),
         ('urchin', 80, '-14, 26, 20'), ('spire', 120, '0, -20, 30')]  # shape, azimuth of the sun, camera


def run(command):
    before = cpu_seconds()
    if subprocess.run(list(map(str, command))).returncode not in (0, 1):  # 1: a photo is doubted
        sys.exit('shown_network.py: failed: ' + ' '.join(map(str, command)))
    return cpu_seconds() - before


def of_data_set(folder, out):
    """Scenes: (name, definitions, [(file, truth)])."""
    manifest = json.loads((folder / 'manifest.json').read_text())
    scenes = {}
    for image in manifest['images']:
        light = manifest['lights'][image['light']]
        if image['split'] == 'unseen_both' and 'environment' not in light:
            scenes.setdefault((image['shape'], image['light']), []).append(image)
    for (shape, light), images in scenes.items():
        mesh = mesh_of(manifest['shapes'][shape], folder, out).resolve()
        sun = ', '.join(map(repr, manifest['lights'][light]['direction']))
        yield (f'{manifest["shapes"][shape]["name"]} {manifest["lights"][light]["azimuth"]:g}', scene_file,
               ['-D', f'mesh={mesh}', '-D', f'sun={sun}', '-D', f'size={manifest["size"]}'],
               [(folder / image['file'], image) for image in images])


def with_rough_boundary(folder):
    """The scene of data sets with another boundary, and with its camera at $camera."""
    folder.mkdir(exist_ok=True)
    place = b'0, -25.924995994286153, 26.374995994286152'
    for file in scene_file.parent.iterdir():
        text = file.read_bytes()
        if file.name == 'object.xml':
            text = text.replace(b'<bsdf type="null" id="boundary"/>',
                                b'<bsdf type="roughdielectric" id="boundary"><float name="alpha" value="0.25"/>'
                                b'<float name="int_ior" value="1.33"/></bsdf>')
            text = text.replace(b'origin="' + place + b'"', b'origin="$camera"')
            text = text.replace(b'<default name="g"', b'<default name="camera" value="' + place + b'"/>\n  <default name="g"')
            if any(new not in text for new in (b'roughdielectric', b'"$camera"', b'name="camera"')):
                sys.exit(f'shown_network.py: {file}: another boundary or camera than this script replaces')
        (folder / file.name).write_bytes(text)
    return folder / scene_file.name


def unlike(out, itn):
    rough = with_rough_boundary(out / 'scene')
    numbers = random.Random(1)
    for shape, azimuth, camera in views:
        angle = math.radians(azimuth)
        scene = ['-D', f'mesh={(out / "shapes" / shape).resolve()}.ply', '-D', f'camera={camera}', '-D', 'size=64', '-D',
                 f'sun={0.5 * math.sin(angle)}, {0.5 * math.cos(angle)}, {sun_height}']
        photos = []
        for k in range(16):
            truth = {'sigma_t': 25 * 12 ** numbers.random(), 'albedo': numbers.uniform(0.3, 0.95), 'g': numbers.uniform(0, 0.9)}
            file = out / f'{shape}_{k}.exr'
            if not file.exists():
                material = [part for name, value in truth.items() for part in ('-D', f'{name}={value}')]
                run([itn, 'render', rough, '-o', file, *scene, *material, '--spp', 128, '--seed', k, '--quiet'])
            photos.append((file, truth))
        yield shape, rough, scene, photos


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('data', type=pathlib.Path, nargs='?')
    parser.add_argument('-o', '--output', type=pathlib.Path, required=True)
    parser.add_argument('--exemplars', type=int, default=24)
    parser.add_argument('--alone', type=int, metavar='N', help='N photos of each scene, each by itself')
    parser.add_argument('--spp', type=int, help='of the exemplars; default: as noisy as the photos')
    parser.add_argument('--run', default='shipped')
    parser.add_argument('--itn', default=str(root / 'build/bin/itn'))
    options = parser.parse_args()
    out = options.output
    out.mkdir(parents=True, exist_ok=True)
    if not (out / 'shapes').exists():
        run([options.itn, 'shapes', '-o', out / 'shapes', '--quiet'])
    run_option = [] if options.run == 'shipped' else [options.run]
    shown = ['--exemplars', options.exemplars] + (['--spp', options.spp] if options.spp else [])
    errors = {who: {name: [] for name in parameters} for who in ('as it is', 'shown the scene')}
    held = {who: {name: 0 for name in parameters} for who in errors}
    seconds = {who: [] for who in errors}
    doubted = {who: [] for who in errors}
    scenes = of_data_set(options.data, out) if options.data else unlike(out, options.itn)
    if options.alone:
        scenes = ((*scene, [photo]) for *scene, photos in scenes for photo in evenly(photos, options.alone, 'photos'))
    for name, scene, definitions, photos in scenes:
        for who, more in (('as it is', []), ('shown the scene', shown)):
            file = out / 'predictions.json'
            seconds[who].append(run([options.itn, 'predict', *run_option, *(photo for photo, _ in photos), '--scene', scene,
                                     *definitions, *more, '--quiet', '--json', file]))
            for said, (_, truth) in zip(json.loads(file.read_text())['images'], photos):
                doubted[who] += [said['doubted']] if 'doubted' in said else []
                for parameter in parameters:
                    value = said[parameter]
                    errors[who][parameter].append(value['value'] - truth[parameter])
                    held[who][parameter] += value['low'] is not None and value['low'] <= truth[parameter] <= value['high']
        print(f'{name}: {len(photos)} photos', file=sys.stderr)
    count = len(errors['as it is']['g'])
    for who in errors:
        print(f'{who}: {count} photos, {statistics.fmean(seconds[who]):.1f} CPU s a command')
        if doubted[who]:
            print(f'  doubted: {statistics.fmean(doubted[who]):.3f} of {len(doubted[who])}')
        for parameter, of in errors[who].items():
            print(f'  {parameter:8} root mean square error {math.sqrt(statistics.fmean(e * e for e in of)):.3g}, median '
                  f'{statistics.median(map(abs, of)):.3g}; 95 % intervals hold {held[who][parameter] / count:.3f}')


if __name__ == '__main__':
    main()
