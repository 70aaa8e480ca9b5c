#!/usr/bin/env python3
"""Lists comments that open as a fragment: "Of one that ...", "What ...", "Where ...". A comment is a sentence with a subject.

tools/comments.py [--count] [FOLDER...]: exit code 1 where there are any.
"""
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
OPENING = re.compile(r'(Of|What|Where|Which|Who|Whose|How|Those)\b')
COMMENT = re.compile(r'//[ /]*(.*)|/\*[ *]*(.*)')


def fragments(file):
    """(line, text) of each block of comment lines that opens with one of these words."""
    found, inside = [], False
    for number, line in enumerate((ROOT / file).read_text(errors='replace').splitlines(), 1):
        match = COMMENT.search(line)
        is_line = line.lstrip().startswith('//')
        if match and not (is_line and inside):
            text = (match[1] or match[2] or '').strip()
            if OPENING.match(text):
                found.append((number, text))
        inside = is_line
    return found


def main():
    folders = [name for name in sys.argv[1:] if not name.startswith('--')] or ['kernels', 'runtime', 'network', 'tools', 'python', 'include', 'tests']
    files = subprocess.run(['git', 'ls-files', *(f'{folder}/**' for folder in folders)], cwd=ROOT, capture_output=True, text=True,
                           check=True).stdout.split()
    count = 0
    for file in files:
        if not file.endswith(('.cpp', '.h', '.cl')):
            continue
        for number, text in fragments(file):
            count += 1
            if '--count' not in sys.argv:
                print(f'{file}:{number}: {text}')
    print(f'{count} comments open as a fragment')
    return 1 if count else 0


if __name__ == '__main__':
    sys.exit(main())
