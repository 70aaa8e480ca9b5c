#!/usr/bin/env python3
"""Prints the rooms of the project with the arrows of their includes, and exits with 1 where one points up.

A room is a folder. ROOMS lists them from the ground up: a room may include those before it, never one after it, so there is no circle.

tools/rooms.py [--quiet]
"""
import collections
import functools
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
ROOMS = [
    'kernels/shared', 'kernels/program', 'kernels/model', 'kernels/geometry', 'kernels/path', 'kernels/texture', 'kernels/derivative',
    'kernels/scattering', 'kernels/light', 'kernels/stage', 'kernels',
    'runtime/base', 'runtime/base/ranks', 'runtime/image', 'runtime/report', 'runtime/scene', 'runtime/scene/shapes', 'runtime/render/device',
    'runtime/render/derivative', 'runtime/render/compile', 'runtime/render/wavefront', 'runtime/render', 'runtime/inverse', 'runtime/view',
    'network/model', 'network/dataset', 'network/training', 'network/prediction', 'network/evaluation', 'tools/itn/bench', 'tools/itn',
    'python',
]
INCLUDE = re.compile(r'\s*#\s*include "([^"]+)"')


# Public headers without a source of their own; of the others the room is that of the source that implements them.
PUBLIC = {
    'colour': 'runtime/base', 'error': 'runtime/base', 'rendering': 'runtime/image', 'parameter_kind': 'runtime/scene',
    'render_options': 'runtime/render/wavefront', 'tensor': 'network/model',
}


def room_of(file):
    """The room with the longest name that the file lies in; None for tests. A public header is of the room that implements it."""
    if file.startswith('include/itn/'):
        return public_room(pathlib.PurePath(file).stem)
    folders = ['/'.join(file.split('/')[:depth]) for depth in range(file.count('/'), 0, -1)]
    return next((folder for folder in folders if folder in ROOMS), None)


@functools.cache
def public_room(name):
    if name in PUBLIC:
        return PUBLIC[name]
    for source in ROOT.glob('[rn]*/**/*.cpp'):  # runtime, network
        with source.open(errors='replace') as text:
            if f'#include "itn/{name}.h"' in text.readline():
                return room_of(str(source.relative_to(ROOT)))
    raise SystemExit(f'include/itn/{name}.h: which room is it of? No source in runtime or network begins with it: add it to PUBLIC')


def arrows():
    """{(room, included room): include lines}, of the files that git knows."""
    files = subprocess.run(['git', 'ls-files', '*.cpp', '*.h', '*.cl'], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
    known = set(files)
    counts = collections.Counter()
    for file in files:
        room = room_of(file)
        if room is None:
            continue
        for line in (ROOT / file).read_text(errors='replace').splitlines():
            match = INCLUDE.match(line)
            if not match:
                continue
            if file.startswith('include/') and not match[1].startswith('itn/'):
                raise SystemExit(f'{file} includes {match[1]}: a public header includes public ones alone')
            places = [match[1], 'include/' + match[1], 'kernels/' + match[1], 'python/src/' + match[1], file.rsplit('/', 1)[0] + '/' + match[1]]
            target = next((place for place in places if place in known), None)
            if target and room_of(target) not in (None, room):
                counts[room, room_of(target)] += 1
    return counts


def main():
    counts, up = arrows(), []
    for room in ROOMS:
        targets = sorted(((ROOMS.index(target), target, n) for (source, target), n in counts.items() if source == room))
        if '--quiet' not in sys.argv:
            print(f'{room:20} -> ' + ', '.join(f'{target} {n}' for _, target, n in targets) if targets else room)
        up += [f'{room} includes {target} ({n} lines), which stands above it: turn the arrow round' for place, target, n in targets
               if place > ROOMS.index(room)]
    print(f'{len(ROOMS)} rooms, {len(counts)} arrows, {len(up)} of them up')
    for line in up:
        print(line, file=sys.stderr)
    return 1 if up else 0


if __name__ == '__main__':
    sys.exit(main())
