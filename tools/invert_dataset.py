#!/usr/bin/env python3
"""Inverts test images of a data set (itn dataset laptop, say) and says how far from the truth the results are.

    tools/invert_dataset.py DIR -o OUT [--images 24] [--itn build/bin/itn] [-- more options of itn invert]

Images of split unseen_both under a sun, evenly over the split; sigma_t, albedo and g by `itn invert scenes/dataset/scene.xml`,
with what follows `--` (--init, --prior ...). OUT gets a folder an image; images that are there already are not inverted again.
Prints a line an image, then for each parameter: root mean square and median of the errors, at the start and at the end, and how
many 95 % intervals hold the truth.
"""
import argparse
import json
import math
import pathlib
import statistics
import subprocess
import sys

root = pathlib.Path(__file__).resolve().parent.parent
parameters = {'sigma_t': 'medium.sigma_t', 'albedo': 'medium.albedo', 'g': 'phase.g'}


def mesh_of(shape, folder, out):
    mesh = shape['mesh']
    if 'file' in mesh:
        return folder / mesh['file']
    if 'named' in mesh:
        return out / 'shapes' / f'{mesh["named"]}.ply'
    sys.exit(f'invert_dataset.py: {shape["name"]}: a random shape, which is no file; use a set with named shapes')


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('data', type=pathlib.Path)
    parser.add_argument('-o', '--output', type=pathlib.Path, required=True)
    parser.add_argument('--images', type=int, default=24)
    parser.add_argument('--itn', default=str(root / 'build/bin/itn'))
    arguments = sys.argv[1:]
    mine = arguments.index('--') if '--' in arguments else len(arguments)
    options, more = parser.parse_args(arguments[:mine]), arguments[mine + 1:]

    with open(options.data / 'manifest.json') as file:
        manifest = json.load(file)
    images = [image for image in manifest['images']
              if image['split'] == 'unseen_both' and 'environment' not in manifest['lights'][image['light']]]
    if len(images) < options.images:
        sys.exit(f'invert_dataset.py: {options.data} has {len(images)} such images, fewer than {options.images}')
    chosen = [images[(2 * k + 1) * len(images) // (2 * options.images)] for k in range(options.images)]
    options.output.mkdir(parents=True, exist_ok=True)
    subprocess.run([options.itn, 'shapes', '-o', options.output / 'shapes', '--quiet'], check=True)

    start, end, held = ({name: [] for name in parameters} for _ in range(3))
    converged, seconds = 0, 0.0
    for image in chosen:
        name = pathlib.Path(image['file']).stem
        result_file = options.output / name / 'result.json'
        if not result_file.exists():
            direction = manifest['lights'][image['light']]['direction']
            command = [options.itn, 'invert', root / 'scenes/dataset/scene.xml', '--target', options.data / image['file'],
                       '-D', f'mesh={mesh_of(manifest["shapes"][image["shape"]], options.data, options.output).resolve()}',
                       '-D', 'sun=' + ', '.join(map(repr, direction)), '-D', f'size={manifest["size"]}',
                       '-o', options.output / name, '--quiet', *more]
            for parameter in parameters.values():
                command += ['--parameter', parameter]
            if subprocess.run(command, stderr=subprocess.DEVNULL).returncode not in (0, 1) or not result_file.exists():
                sys.exit('invert_dataset.py: failed: ' + ' '.join(map(str, command)))
        result = json.loads(result_file.read_text())
        converged += result['converged']
        seconds += result['time']['total_s']
        line = f'{name} {"converged" if result["converged"] else "NOT converged"} {result["time"]["total_s"]:.1f} s'
        for short, parameter in parameters.items():
            truth, found, first = image[short], result['parameters'][parameter], result['starts'][0]['from'][parameter]
            start[short].append(first - truth)
            end[short].append(found['value'] - truth)
            held[short].append(found['low'] <= truth <= found['high'])
            line += f'  {short} {truth:.3g}: {first:.3g} -> {found["value"]:.3g} ({found["low"]:.3g} to {found["high"]:.3g})'
        print(line, flush=True)

    print(f'{converged} of {len(chosen)} converged, {seconds / len(chosen):.1f} s each')
    for short in parameters:
        errors = [f'{math.sqrt(statistics.fmean(x * x for x in e)):.3g} / {statistics.median(map(abs, e)):.3g}'
                  for e in (start[short], end[short])]
        print(f'{short:8} root mean square / median error: start {errors[0]}, end {errors[1]}; '
              f'{sum(held[short])} intervals hold the truth')


if __name__ == '__main__':
    main()
