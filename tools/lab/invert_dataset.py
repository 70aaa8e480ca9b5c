#!/usr/bin/env python3
"""Inverts test images of a data set (itn dataset laptop, say) and says how far from the truth the results are.

    tools/lab/invert_dataset.py DIR -o OUT [--scenes 24] [--photos 1] [--renderings] [--itn build/bin/itn] [-- more options of itn invert]

Of split unseen_both, under a sun: so many scenes (a shape in a light), and so many photos of each, evenly over the split; sigma_t,
albedo and g by `itn invert scenes/dataset/scene.xml`, with what follows `--` (--init, --prior, --method posterior ...). --renderings
keeps those that the posterior makes of a scene for its next photo. OUT gets a folder an image; images that are there already are
not inverted again.

Prints a line an image, then for each parameter: root mean square, mean and median of the errors of a constant guess, of the network
that ships with itn and of the inversion, how many 95 % intervals hold the truth, and in which tenth of the posterior it lies.
OUT/intervals.svg shows photos, the intervals of both, and the truth.
"""
import argparse
import csv
import json
import math
import pathlib
import resource
import statistics
import subprocess
import sys

from interval_picture import interval_picture

root = pathlib.Path(__file__).resolve().parents[2]
scene_file = root / 'scenes/dataset/scene.xml'
parameters = {'sigma_t': 'medium.sigma_t', 'albedo': 'medium.albedo', 'g': 'phase.g'}
titles = {'sigma_t': 'sigma_t [1/scene unit]', 'albedo': 'albedo', 'g': 'g'}


def mesh_of(shape, folder, out):
    mesh = shape['mesh']
    if 'file' in mesh:
        return folder / mesh['file']
    if 'named' in mesh:
        return out / 'shapes' / f'{mesh["named"]}.ply'
    sys.exit(f'invert_dataset.py: {shape["name"]}: a random shape, which is no file; use a set with named shapes')


def evenly(items, count, what):
    if len(items) < count:
        sys.exit(f'invert_dataset.py: {len(items)} {what}, fewer than {count}')
    return [items[(2 * k + 1) * len(items) // (2 * count)] for k in range(count)]


def cpu_seconds():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def run(command, makes, codes=(0,)):
    """The CPU seconds that it took."""
    before = cpu_seconds()
    if subprocess.run(command, stderr=subprocess.DEVNULL).returncode not in codes or not makes.exists():
        sys.exit('invert_dataset.py: failed: ' + ' '.join(map(str, command)))
    return cpu_seconds() - before


def network_guesses(itn, scene, images, definitions, out):
    file = out / f'{scene}_network.json'
    if not file.exists():
        run([itn, 'predict', *images, '--scene', scene_file, *definitions, '--quiet', '--json', file], makes=file)
    return json.loads(file.read_text())['images']


def samples_of(folder):
    """The posterior's, a list a parameter; None: another method's result."""
    file = folder / 'samples.csv'
    if not file.exists():
        return None
    with open(file) as opened:
        rows = list(csv.DictReader(opened))
    return {short: [float(row[name]) for row in rows] for short, name in parameters.items()}


def inside_jointly(samples, truth):
    """Nearer to the middle than 95 % of the samples, by their covariance, with sigma_t in its logarithm?"""
    def point(of):
        return [math.log(of['sigma_t']), of['albedo'], of['g']]
    points = [point(dict(zip(samples, values))) for values in zip(*samples.values())]
    middle = [statistics.fmean(axis) for axis in zip(*points)]
    ways = [[a - m for a, m in zip(p, middle)] for p in (*points, point(truth))]
    # Gram-Schmidt over the samples: each axis without what the axes before it say, of length 1.
    lengths = [0.0] * len(ways)
    for k in range(3):
        norm = statistics.fmean(w[k] ** 2 for w in ways[:-1])
        for l in range(k + 1, 3):
            slope = statistics.fmean(w[k] * w[l] for w in ways[:-1]) / norm
            for w in ways:
                w[l] -= slope * w[k]
        lengths = [length + w[k] ** 2 / norm for length, w in zip(lengths, ways)]
    return sum(length < lengths[-1] for length in lengths[:-1]) <= 0.95 * len(points)


def error_words(errors):
    return (f'{math.sqrt(statistics.fmean(e * e for e in errors)):.3g} / {statistics.fmean(map(abs, errors)):.3g} / '
            f'{statistics.median(map(abs, errors)):.3g}')


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('data', type=pathlib.Path)
    parser.add_argument('-o', '--output', type=pathlib.Path, required=True)
    parser.add_argument('--scenes', type=int, default=24)
    parser.add_argument('--photos', type=int, default=1, help='of each scene')
    parser.add_argument('--renderings', action='store_true', help='keep those of a scene for its next photo')
    parser.add_argument('--itn', default=str(root / 'build/bin/itn'))
    arguments = sys.argv[1:]
    mine = arguments.index('--') if '--' in arguments else len(arguments)
    options, more = parser.parse_args(arguments[:mine]), arguments[mine + 1:]

    manifest = json.loads((options.data / 'manifest.json').read_text())
    scenes = {}
    for image in manifest['images']:
        if image['split'] == 'unseen_both' and 'environment' not in manifest['lights'][image['light']]:
            scenes.setdefault((image['shape'], image['light']), []).append(image)
    options.output.mkdir(parents=True, exist_ok=True)
    run([options.itn, 'shapes', '-o', options.output / 'shapes', '--quiet'], makes=options.output / 'shapes')

    config = json.loads(manifest['config']) if isinstance(manifest['config'], str) else manifest['config']
    low, high = config['sigma_t']
    constant = {'sigma_t': (high - low) / math.log(high / low), 'albedo': statistics.fmean(config['albedo']),
                'g': statistics.fmean(config['g'])}
    errors = {who: {short: [] for short in parameters} for who in ('constant guess', 'network', 'inversion', 'converged')}
    held, held_by_network = ({short: [] for short in parameters} for _ in range(2))
    tenths = {short: [0] * 10 for short in parameters}
    joint, converged, first_seconds, next_seconds, shown = [], 0, [], [], []
    for shape, light in evenly(list(scenes), options.scenes, 'scenes'):
        scene = f'{manifest["shapes"][shape]["name"]}_{manifest["lights"][light]["azimuth"]:g}'
        mesh = mesh_of(manifest['shapes'][shape], options.data, options.output).resolve()
        definitions = ['-D', f'mesh={mesh}', '-D', 'sun=' + ', '.join(map(repr, manifest['lights'][light]['direction'])),
                       '-D', f'size={manifest["size"]}']
        chosen = evenly(scenes[shape, light], options.photos, f'photos of {scene}')
        files = [options.data / image['file'] for image in chosen]
        guesses = network_guesses(options.itn, scene, files, definitions, options.output)
        for order, (image, file, guess) in enumerate(zip(chosen, files, guesses)):
            folder = options.output / file.stem
            cpu_file = folder / 'cpu_seconds'
            if not cpu_file.exists():
                command = [options.itn, 'invert', scene_file, '--target', file, *definitions, '-o', folder, '--quiet', *more]
                for parameter in parameters.values():
                    command += ['--parameter', parameter]
                if options.renderings:
                    command += ['--renderings', options.output / 'renderings' / scene]
                seconds = run(command, makes=folder / 'result.json', codes=(0, 1))
                cpu_file.write_text(f'{seconds:.1f}\n')
            result = json.loads((folder / 'result.json').read_text())
            seconds = float(cpu_file.read_text())
            (next_seconds if order else first_seconds).append(seconds)
            converged += result['converged']
            line = f'{file.stem} {scene} {"converged" if result["converged"] else "NOT converged"} {seconds:.1f} s'
            samples = samples_of(folder)
            shown.append({'folder': folder, 'truth': image, 'network': guess,
                          'found': {short: result['parameters'][name] for short, name in parameters.items()}})
            (options.output / 'intervals.svg').write_text(interval_picture(shown, titles))
            for short, parameter in parameters.items():
                truth, found, by_network = image[short], result['parameters'][parameter], guess[short]
                errors['constant guess'][short].append(constant[short] - truth)
                errors['network'][short].append(by_network['value'] - truth)
                errors['inversion'][short].append(found['value'] - truth)
                if result['converged']:
                    errors['converged'][short].append(found['value'] - truth)
                held[short].append(found['low'] <= truth <= found['high'])
                held_by_network[short].append(by_network['low'] <= truth <= by_network['high'])
                line += (f'  {short} {truth:.3g}: {by_network["value"]:.3g} -> {found["value"]:.3g} '
                         f'({found["low"]:.3g} to {found["high"]:.3g})')
                if samples:
                    below = sum(value < truth for value in samples[short])
                    tenths[short][min(9, 10 * below // len(samples[short]))] += 1
            if samples:
                joint.append(inside_jointly(samples, image))
            print(line, flush=True)

    count = options.scenes * options.photos
    print(f'{converged} of {count} converged; CPU seconds: {statistics.fmean(first_seconds):.1f} for the first photo of a scene'
          + (f', {statistics.fmean(next_seconds):.1f} for each further one' if next_seconds else ''))
    for short in parameters:
        print(f'{short}: root mean square / mean / median error')
        for who, of in errors.items():
            if of[short] and (who != 'converged' or converged < count):
                print(f'  {who:15} {error_words(of[short])}')
        print(f'  95 % intervals that hold the truth: {sum(held[short])} of {count}; of the network {sum(held_by_network[short])}')
        if joint:
            print(f'  ranks of the truth, in tenths: {tenths[short]}')
    if joint:
        print(f'95 % regions of all three that hold the truth: {sum(joint)} of {count}')


if __name__ == '__main__':
    main()
