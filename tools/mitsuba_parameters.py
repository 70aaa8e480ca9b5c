#!/usr/bin/env python3
"""Does each parameter of Mitsuba 3.9's plugins do here what it does there? A small scene for each, rendered with two values.

    tools/mitsuba_parameters.py                    against Mitsuba's values in tests/tool/mitsuba_parameters.json
    tools/mitsuba_parameters.py --quick            those alone that share a few programs: what the test suite runs
    tools/mitsuba_parameters.py --only sensor.     those whose names begin so; may be repeated
    tools/mitsuba_parameters.py --mitsuba PYTHON   renders them with the Mitsuba of that interpreter first, and stores its values

The image's mean must agree with Mitsuba's within both standard errors for both values, and differ between the two exactly
when Mitsuba's does. Exit code 1 where one does not. Scenes stand in mitsuba_scenes.py.
"""
import argparse
import concurrent.futures
import json
import math
import os
import subprocess
import sys
import tempfile

from mitsuba_scenes import ROWS, write_files

HERE = os.path.dirname(os.path.abspath(__file__))
STORED = os.path.join(HERE, '..', 'tests', 'tool', 'mitsuba_parameters.json')
MOST = 5.0  # standard errors: some 2,000 comparisons
SEEDS = 16  # of Mitsuba's images, whose spread is their standard error


def render_here(itn, folder, name, number, row):
    """Mean and standard error of each channel, or the message of the refusal."""
    file = os.path.join(folder, f'{name}.{number}.xml')
    with open(file, 'w') as scene:
        scene.write(row.scenes[number])
    run = subprocess.run([itn, 'render', file, '-o', file + '.exr', '--quiet', '--json', '-', '--spp', str(row.spp), '--seed',
                          str(1 + number)], capture_output=True, text=True)
    if run.returncode:
        return run.stderr.strip()
    image = json.loads(run.stdout)
    mean, error = image['mean'], image['mean_stderr']
    return [mean * 3, error * 3] if len(mean) == 1 else [mean, error]


def render_there():
    """The other interpreter: scenes from standard input, their values to standard output."""
    import mitsuba
    import numpy
    task = json.load(sys.stdin)
    mitsuba.set_variant(task['variant'])
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    os.chdir(task['folder'])
    for name, number, text, spp in task['scenes']:
        try:
            scene = mitsuba.load_string(text)
            means = []
            for seed in range(SEEDS):
                image = numpy.array(mitsuba.render(scene, spp=max(spp // SEEDS, 1), seed=seed), dtype=float)
                image = image.reshape(image.shape[0], image.shape[1], -1)
                image = image[:, :, :3] if image.shape[2] >= 3 else numpy.repeat(image[:, :, :1], 3, axis=2)
                means.append(image.mean(axis=(0, 1)))
            spread = numpy.std(means, axis=0, ddof=1) / math.sqrt(SEEDS)
            value = [numpy.mean(means, axis=0).tolist(), spread.tolist()]
        except Exception as error:  # what it refuses is a finding, too
            value = str(error).strip().splitlines()[-1]
        print(json.dumps([name, number, value]), flush=True)


def ask_mitsuba(python, folder, rows):
    values = {}
    for variant in sorted({row.variant for row in rows.values()}):
        scenes = [[name, number, row.scenes[number], row.spp] for name, row in rows.items() if row.variant == variant
                  for number in (0, 1)]
        run = subprocess.run([python, os.path.abspath(__file__), '--there'], input=json.dumps(
            {'variant': variant, 'folder': folder, 'scenes': scenes}), stdout=subprocess.PIPE, text=True, check=True)
        for line in run.stdout.splitlines():
            if not line.startswith('["'):
                continue
            name, number, value = json.loads(line)
            values.setdefault(name, [None, None])[number] = value
    return values


def apart(a, b):
    """How many standard errors two values are apart, at most over the channels."""
    return max(abs(p - q) / max(math.hypot(s, t), 2e-6 * max(abs(p), abs(q), 1e-3))
               for p, q, s, t in zip(a[0], b[0], a[1], b[1]))


def faults(row, here, there):
    found = []
    for number in (0, 1):
        if isinstance(there[number], str) or isinstance(here[number], str):
            found.append(f'value {number}: here {here[number]}, in Mitsuba {there[number]}')
        elif apart(here[number], there[number]) > MOST:
            found.append(f'value {number}: {apart(here[number], there[number]):.1f} standard errors apart: here '
                         f'{shown(here[number])}, in Mitsuba {shown(there[number])}')
    if found:
        return found
    moves_here, moves_there = apart(*here) > MOST, apart(*there) > MOST
    if moves_there != row.moves:
        found.append(f'Mitsuba\'s image {"changes" if moves_there else "does not change"}, which the scene is not meant for')
    if moves_here != row.moves:
        found.append(f'the image {"changes" if moves_here else "does not change"}: here {shown(here[0])} and '
                     f'{shown(here[1])}, in Mitsuba {shown(there[0])} and {shown(there[1])}')
    return found


def shown(value):
    return ' '.join(f'{mean:.5f}±{error:.5f}' for mean, error in zip(*value))


def main():
    if sys.argv[1:] == ['--there']:
        return render_there()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--itn', default=os.path.join(HERE, '..', 'build', 'bin', 'itn'))
    parser.add_argument('--mitsuba', metavar='PYTHON', help='an interpreter that has Mitsuba 3.9')
    parser.add_argument('--quick', action='store_true')
    parser.add_argument('--only', action='append', default=[], metavar='NAME')
    options = parser.parse_args()
    rows = {name: row for name, row in ROWS.items()
            if (row.quick or not options.quick) and (not options.only or name.startswith(tuple(options.only)))}
    stored = {}
    if os.path.exists(STORED):
        with open(STORED) as file:
            stored = json.load(file)
    with tempfile.TemporaryDirectory() as folder:
        write_files(folder)
        if options.mitsuba:
            stored.update(ask_mitsuba(options.mitsuba, folder, rows))
            with open(STORED, 'w') as file:
                lines = [f'{json.dumps(name)}: {rounded(stored[name])}' for name in sorted(stored) if name in ROWS]
                file.write('{\n' + ',\n'.join(lines) + '\n}\n')
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            here = {(name, number): pool.submit(render_here, options.itn, folder, name, number, row)
                    for name, row in rows.items() for number in (0, 1)}
            wrong = 0
            for name, row in rows.items():
                found = faults(row, [here[name, number].result() for number in (0, 1)], stored[name]) \
                    if name in stored else ['Mitsuba\'s values are not stored: give --mitsuba']
                wrong += bool(found)
                for text in found:
                    print(f'{name}: {text}', flush=True)
    print(f'{len(rows) - wrong} of {len(rows)} parameters do what they do in Mitsuba')
    return 1 if wrong else 0


def rounded(values):
    return json.dumps([value if isinstance(value, str) else [[float(f'{x:.6g}') for x in part] for part in value]
                       for value in values])


if __name__ == '__main__':
    sys.exit(main())
