#!/usr/bin/env python3
"""Prints runtime/scene/xml/metals.inc: the indices of refraction of Mitsuba 3's named metals in linear sRGB, as its rgb variants
convert them.

    .peers/bin/python tools/lab/mitsuba_metals.py > runtime/scene/xml/metals.inc    # tools/peers makes .peers
"""
import glob
import os

import mitsuba as mi


def numbers(color):
    return '{%s}' % ', '.join('%.7g' % float(c) for c in color)


def main():
    mi.set_variant('scalar_rgb')
    mi.set_log_level(mi.LogLevel.Error)  # some colours are out of gamut, and clamped
    print(f'// Written by tools/lab/mitsuba_metals.py with Mitsuba {mi.__version__}, {mi.variant()}; see THIRD-PARTY.md.')
    folder = os.path.join(os.path.dirname(mi.__file__), 'data', 'ior')
    for path in sorted(glob.glob(os.path.join(folder, '*.eta.spd'))):
        name = os.path.basename(path)[:-len('.eta.spd')]
        parameters = mi.traverse(mi.load_dict({'type': 'conductor', 'material': name}))
        print('{"%s", {%s, %s}},' % (name, numbers(parameters['eta.value']), numbers(parameters['k.value'])))


if __name__ == '__main__':
    main()
