#!/usr/bin/env python3
"""No function of the kernels is longer than a screen.

function_lengths.py FOLDER LIMIT: exits with 1 and names every function in FOLDER/**/*.{h,cl} that has more than LIMIT lines,
from the first of its declaration to its closing brace, comments and macros inside included. A function ends with a brace
at the beginning of a line; one that stands on a single line is short."""
import pathlib
import re
import sys


def functions(text):
    """(name, first line, lines) of each."""
    begin = None
    in_comment = in_macro = False
    for number, line in enumerate(text.split('\n'), 1):
        outside = begin is None
        if outside and (in_comment or line.startswith('/*')):
            in_comment = '*/' not in line
        elif outside and (in_macro or line.startswith('#')):
            in_macro = line.endswith('\\')
        elif outside and re.match(r'\w', line):
            begin, declaration = number, line
        elif not outside and '{' not in declaration:
            declaration += ' ' + line.strip()
        if begin and (line.startswith('}') or '{' not in declaration and ';' in declaration or
                      begin == number and re.search(r'[};]$', line)):
            name = re.search(r'(\w+)\s*\(', re.sub(r'__attribute__\s*\(\([^()]*(\([^()]*\))?\)\)', '', declaration))
            if name and '{' in declaration:
                yield name[1], begin, number - begin + 1
            begin = None


def check_itself():
    """It must see what it counts."""
    body = '  step();\n' * 9
    text = ('/* a (comment) {\n * of two lines */\n#define MACRO(x) \\\n  { x }\n\ntypedef struct {\n  int a;\n} Record;\n'
            'inline int one(int a) { return a; }\n__attribute__((always_inline)) inline void two(int a,\n        int b) {\n'
            + body + '}\n\n__kernel __attribute__((reqd_work_group_size(1, 1, 1))) void three(int a) {\n#if A\n' + body +
            '#endif\n}\n')
    found = list(functions(text))
    assert found == [('one', 9, 1), ('two', 10, 12), ('three', 23, 13)], found


def main(folder, limit):
    check_itself()
    files = sorted(p for p in pathlib.Path(folder).rglob('*') if p.suffix in ('.h', '.cl'))
    all_of_them = [(lines, name, path, first) for path in files for name, first, lines in functions(path.read_text())]
    assert len(all_of_them) > 200, f'only {len(all_of_them)} functions found'
    long = sorted((f for f in all_of_them if f[0] > limit), reverse=True)
    for lines, name, path, first in long:
        print(f'{path}:{first}: {name} has {lines} lines; at most {limit}')
    longest = max(all_of_them)
    print(f'{len(all_of_them)} functions in {len(files)} files; the longest is {longest[1]} with {longest[0]} lines')
    return 1 if long else 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1], int(sys.argv[2])))
