#!/usr/bin/env python3
"""Which of other people's Mitsuba scenes open here, and what the others lack.

    tools/lab/open_scenes.py FOLDER...            every .xml file within
    tools/lab/open_scenes.py FOLDER --list FILE   the ones that FILE names, a path in FOLDER a line

A scene opens when `itn parameters` reads it; nothing is rendered. For each other one its missing plugins stand beside it
(or, where no plugin is missing, the first message), and at the end how many scenes wait for each plugin, and how many of
them for nothing else. Files that only other scenes include count as scenes, too: --list leaves them out.
Exit code 0 when all open, 1 when some do not.
"""
import argparse
import collections
import concurrent.futures
import os
import re
import subprocess
import sys

unknown_type = re.compile(r'unknown type "([^"]*)" of <(\w+)>')
misplaced = re.compile(r'<(\w+) type="([^"]*)">.* does not belong here')


def scene_files(folder, listed):
    if listed:
        with open(listed) as lines:
            return [os.path.join(folder, line.strip()) for line in lines if line.strip() and not line.startswith('#')]
    return sorted(os.path.join(root, name) for root, _, names in os.walk(folder) for name in names
                  if name.endswith('.xml'))


def lacks(itn, definitions, file):
    """Empty when the scene opens; else what is missing: plugins as "bsdf plastic", or the first other message."""
    command = [itn, 'parameters', file, '--quiet'] + [word for text in definitions for word in ('-D', text)]
    try:
        run = subprocess.run(command, capture_output=True, text=True, errors='replace', timeout=300)
    except subprocess.TimeoutExpired:
        return ['more than 300 s'], 'more than 300 s'
    if run.returncode == 0:
        return [], ''
    plugins = {f'{tag} {name}' for name, tag in unknown_type.findall(run.stderr)}
    plugins |= {f'{tag} {name}' for tag, name in misplaced.findall(run.stderr)}
    message = run.stderr.strip().removeprefix('itn: ')
    return sorted(plugins) or [message.splitlines()[0] if message else f'exit code {run.returncode}'], message


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('folders', nargs='+', metavar='FOLDER')
    parser.add_argument('--list', metavar='FILE', help='paths in FOLDER, one a line')
    parser.add_argument('--itn', default=os.path.join(os.path.dirname(__file__), '..', '..', 'build', 'bin', 'itn'))
    parser.add_argument('-D', action='append', default=[], metavar='name=value', dest='definitions',
                        help='passed on to itn')
    parser.add_argument('--messages', action='store_true', help='print the whole message of each scene that is refused')
    options = parser.parse_args()
    files = [file for folder in options.folders for file in scene_files(folder, options.list)]
    if not files:
        parser.error('no .xml file in ' + ', '.join(options.folders))
    waiting, alone, opened = collections.Counter(), collections.Counter(), 0
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        results = pool.map(lambda file: lacks(options.itn, options.definitions, file), files)
        for file, (missing, message) in zip(files, results):
            print(f'{file}: {"; ".join(missing) if missing else "opens"}', flush=True)
            if options.messages and message:
                print('  ' + message.replace('\n', '\n  '))
            opened += not missing
            waiting.update(missing)
            alone.update(missing if len(missing) == 1 else [])
    print(f'\n{opened} of {len(files)} open')
    for what, count in sorted(waiting.items(), key=lambda item: (-item[1], item[0])):
        print(f'{count:4} wait for {what}, {alone[what]} of them for nothing else')
    return 0 if opened == len(files) else 1


if __name__ == '__main__':
    sys.exit(main())
