#!/usr/bin/env python3
"""Which photos that something is wrong with are doubted, by a network that is shown the scene (itn predict --exemplars).

    PYTHONPATH=build/python tools/lab/spoilt_photos.py DIR -o OUT [--scenes 24] [--photos 1] [--alone | --posterior]

Takes photos of a data set (itn dataset laptop, say): of split unseen_both, under a sun, so many scenes and so many photos of
each, evenly over the split. Each is spoilt in every way of the table that is printed: as a picture, or rendered anew in another
scene than the one that the network is shown, with the 128 samples of `laptop`. All photos of a scene share its 24 exemplars, or
with --alone each has its own. --posterior: which does `itn invert --method posterior` say not to fit? All photos of a scene share
its renderings; what has been inverted in OUT is kept.

Prints how many of each kind are doubted, and how many of the 95 % intervals hold the truth. Needs the package itn and numpy.
"""
import argparse
import pathlib
import random
import subprocess
import sys
import warnings

import numpy as np

import itn
from invert_dataset import evenly, parameters, root, scene_file
from shown_network import of_data_set, with_rough_boundary


def blurred(image, deviation):
    at = np.arange(-6, 7)
    kernel = np.exp(-0.5 * (at / deviation) ** 2)
    kernel /= kernel.sum()
    for axis in (0, 1):
        image = np.apply_along_axis(lambda line: np.convolve(np.pad(line, 6, mode='edge'), kernel, 'valid'), axis, image)
    return image


def of_curve(image, power):
    mean = image.mean()
    return mean * (np.maximum(image, 0) / mean) ** power


def noisy(image, share, numbers):
    return image * (1 + share * numbers.standard_normal(image.shape))


def half_of(image, other):
    result = image.copy()
    result[:, image.shape[1] // 2:] = other[:, image.shape[1] // 2:]
    return result


# What is wrong: the spoilt picture, of the picture and random numbers.
pictures = {
    'nothing': lambda image, numbers: image,
    'moved by half a pixel': lambda image, numbers: (image + np.roll(image, 1, 1)) / 2,
    'moved by a pixel': lambda image, numbers: np.roll(image, 1, 1),
    'blur of 0.7 pixels': lambda image, numbers: blurred(image, 0.7),
    'blur of 1.5 pixels': lambda image, numbers: blurred(image, 1.5),
    '5 % saturated': lambda image, numbers: np.minimum(image, np.quantile(image, 0.95)),
    '20 % saturated': lambda image, numbers: np.minimum(image, np.quantile(image, 0.8)),
    'noise of 3 % that the file does not tell': lambda image, numbers: noisy(image, 0.03, numbers),
    'noise of 10 %': lambda image, numbers: noisy(image, 0.1, numbers),
    'exposed 1.1 times': lambda image, numbers: 1.1 * image,
    'power 0.8': lambda image, numbers: of_curve(image, 0.8),
    'power 1.3': lambda image, numbers: of_curve(image, 1.3),
}


def turned(sun, degrees):
    x, y, z = map(float, sun.split(','))
    angle = np.radians(degrees)
    return f'{x * np.cos(angle) + y * np.sin(angle)}, {y * np.cos(angle) - x * np.sin(angle)}, {z}'


# What is wrong with the scene: its file and definitions.
def scenes(definitions, rough, other_mesh):
    return {
        'the sun 5 degrees farther round': (scene_file, definitions | {'sun': turned(definitions['sun'], 5)}),
        'the sun 15 degrees farther round': (scene_file, definitions | {'sun': turned(definitions['sun'], 15)}),
        'another boundary: alpha 0.25, n = 1.33': (rough, definitions),
        'another shape': (scene_file, definitions | {'mesh': other_mesh}),
    }


def rendered(scene, definitions, truth, spp, seed):
    scene = itn.load(scene, defines=definitions)
    for parameter, name in parameters.items():
        scene.parameters[name] = truth[parameter]
    return np.squeeze(itn.render(scene, spp=spp, seed=seed).image)


def by_network(scene, files, _):
    """Of each photo: is it doubted, the doubt over its limit, and the intervals."""
    said = itn.predict(files, 'shipped', scene=scene, exemplars=24)
    return [(doubt > said.doubt_limit, doubt / said.doubt_limit, {p: said.intervals[p][k] for p in parameters})
            for k, doubt in enumerate(said.doubt)]


def by_posterior(scene, files, renderings):
    """The same, but for the doubt: how many standard deviations more than noise neighbouring pixels have in common."""
    ranges = dict(zip(parameters.values(), ((25, 300), (0.3, 0.95), (0, 0.9))))
    answers = []
    for file in files:
        found = itn.invert(scene, file, list(ranges), method='posterior', range=ranges, output=file.with_suffix(''),
                           renderings=renderings)
        fit = found.json['fit']
        answers.append((not fit['fits'], fit['structure'], {p: (found[name].low, found[name].high) for p, name in parameters.items()}))
    return answers


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('data', type=pathlib.Path)
    parser.add_argument('-o', '--output', type=pathlib.Path, required=True)
    parser.add_argument('--scenes', type=int, default=24)
    parser.add_argument('--photos', type=int, default=1)
    who = parser.add_mutually_exclusive_group()
    who.add_argument('--alone', action='store_true')
    who.add_argument('--posterior', action='store_true')
    options = parser.parse_args()
    out = options.output
    out.mkdir(parents=True, exist_ok=True)
    if not (out / 'shapes').exists():
        subprocess.run([root / 'build/bin/itn', 'shapes', '-o', out / 'shapes', '--quiet'], check=True)
    rough = with_rough_boundary(out / 'rough')
    warnings.simplefilter('ignore')
    found, held, doubts = {}, {}, {}
    for name, _, texts, photos in evenly(list(of_data_set(options.data, out)), options.scenes, 'scenes'):
        definitions = dict(text.split('=', 1) for text in texts if text != '-D')
        other_mesh = str(next(mesh for mesh in sorted((out / 'shapes').resolve().glob('*.ply'))
                              if mesh.stem != name.split()[0]))
        spoilt = []  # what, file, truth
        for file, truth in evenly(photos, options.photos, 'photos'):
            seed = random.Random(str(file)).getrandbits(31)
            numbers = np.random.default_rng(seed)
            photo = itn.read_exr(file)
            images = {what: spoil(photo['Y'], numbers) for what, spoil in pictures.items()}
            for what, (scene, given) in scenes(definitions, rough, other_mesh).items():
                images[what] = rendered(scene, given, truth, 128, seed)
            other = {'sigma_t': 7500 / truth['sigma_t'], 'albedo': 1.25 - truth['albedo'], 'g': 0.9 - truth['g']}
            images['half of it another material'] = half_of(photo['Y'], rendered(scene_file, definitions, other, 128, seed))
            for what, image in images.items():
                spoilt.append((what, out / f'{file.stem}_{len(spoilt)}.exr', truth))
                itn.write_exr(spoilt[-1][1], {'Y': image, 'stderr.Y': photo['stderr.Y']})
        shown = itn.load(scene_file, defines=definitions)
        answer = by_posterior if options.posterior else by_network
        for some in [[one] for one in spoilt] if options.alone else [spoilt]:
            answers = answer(shown, [file for _, file, _ in some], out / f'renderings of {name}')
            for (what, _, truth), (doubted, doubt, intervals) in zip(some, answers):
                doubts.setdefault(what, []).append(doubt)
                found.setdefault(what, []).append(doubted)
                held.setdefault(what, []).extend(intervals[p][0] <= truth[p] <= intervals[p][1] for p in parameters)
        print(name, file=sys.stderr)
    print(f'{len(found["nothing"])} photos')
    for what in found:
        print(f'{what:40} doubted {np.mean(found[what]):.3f}  median doubt {np.median(doubts[what]):6.2f}  '
              f'intervals hold {np.mean(held[what]):.3f}')


if __name__ == '__main__':
    main()
