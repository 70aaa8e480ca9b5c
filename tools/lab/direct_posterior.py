#!/usr/bin/env python3
"""The posterior of itn invert beside one by direct sampling: the likelihoods of renderings at thousands of materials.

    PYTHONPATH=build/python tools/lab/direct_posterior.py -o OUT [--materials 10000] [--only NAME]

Photos of few pixels that tell two numbers badly, so that what is known of them is bent or has two peaks. A rendering has 64 times the
samples that would make it as noisy as the photo, so that its noise moves the logarithm of a likelihood by 1 or less; a parabola through
some 150 neighbours is taken before the exponential.

Prints for both numbers mean, standard deviation, what 95 % lie between and the share in the lower half of the range, and the correlation,
in the coordinates in which the range is even (log sigma_t); and draws both. Needs the package itn and numpy. Renderings are kept in OUT.
"""
import argparse
import csv
import pathlib

import numpy as np

import itn

root = pathlib.Path(__file__).resolve().parents[2]


def dataset_scene(size):
    return itn.load(root / 'scenes/dataset/scene.xml', defines={'size': size})


def ball_across_the_light(size):
    return itn.load_dict({
        'type': 'scene',
        'integrator': {'type': 'volpath'},
        'sensor': {'type': 'orthographic', 'to_world': itn.Transform().look_at(origin=[0, 0, 4], target=[0, 0, 0], up=[0, 1, 0]).scale(0.6),
                   'film': {'type': 'hdrfilm', 'width': size, 'height': size, 'pixel_format': 'luminance'}},
        'light': {'type': 'directional', 'direction': [1, 0, 0]},
        'ball': {'type': 'sphere', 'boundary': {'type': 'null'},
                 'interior': {'type': 'homogeneous', 'id': 'medium', 'phase': {'type': 'hg', 'id': 'phase'}}}})


cases = {
    'similarity': {
        'title': 'a bright body: sigma_t (1 - g) is known, hardly more', 'scene': dataset_scene, 'size': 8, 'spp': 16,
        'parameters': {'medium.sigma_t': (10, 300), 'phase.g': (0, 0.95)},
        'truth': {'medium.sigma_t': 80, 'medium.albedo': 0.95, 'phase.g': 0.6}},
    'four pixels': {
        'title': 'a thin body in four pixels', 'scene': dataset_scene, 'size': 2, 'spp': 256,
        'parameters': {'medium.sigma_t': (0.3, 300), 'phase.g': (0, 0.95)},
        'truth': {'medium.sigma_t': 3, 'medium.albedo': 0.99, 'phase.g': 0.5}},
    'two peaks': {  # at a right angle as much is scattered by g as by -g
        'title': 'a thin ball seen across the light: g or -g', 'scene': ball_across_the_light, 'size': 8, 'spp': 128,
        'parameters': {'medium.albedo': (0.7, 0.99), 'phase.g': (-0.9, 0.9)},
        'truth': {'medium.sigma_t': 0.2, 'medium.albedo': 0.9, 'phase.g': 0.6}},
}


def is_logarithmic(name):
    return name.endswith('sigma_t')


class Range:
    def __init__(self, name, low, high):
        self.name, self.logarithmic = name, is_logarithmic(name)
        self.low, self.high = (np.log(low), np.log(high)) if self.logarithmic else (low, high)

    def value(self, share):
        at = self.low + share * (self.high - self.low)
        return np.exp(at) if self.logarithmic else at

    def share(self, value):
        return ((np.log(value) if self.logarithmic else value) - self.low) / (self.high - self.low)


def low_discrepancy(count):
    ratio = 1.32471795724474602596  # Roberts 2018, two dimensions
    return (0.5 + np.outer(np.arange(1, count + 1), [1 / ratio, 1 / ratio**2])) % 1


def loaded(case):
    scene = case['scene'](case['size'])
    for name, value in case['truth'].items():
        scene.parameters[name] = value
    return scene


def photo_of(case):
    """What the camera would take, with normal noise, and its standard errors."""
    fine_spp = 16384
    fine = itn.render(loaded(case), spp=fine_spp, seed=1)
    deviation = np.squeeze(fine.stderr) * np.sqrt(fine_spp / case['spp'])
    noise = np.random.default_rng(1).standard_normal(deviation.shape)
    return np.squeeze(fine.image) + deviation * noise, deviation


def likelihoods(case, photo, ranges, count, file):
    """Points, a row each in shares of the ranges, and the logarithms of their likelihoods."""
    points = low_discrepancy(count)
    if file.exists():
        return points, np.load(file)
    scene = loaded(case)
    image, deviation = photo
    spp = 64 * case['spp']
    result = np.empty(count)
    for k, point in enumerate(points):
        for r, share in zip(ranges, point):
            scene.parameters[r.name] = r.value(share)
        rendered = itn.render(scene, spp=spp, seed=1000 + k)
        variance = deviation**2 + np.squeeze(rendered.stderr)**2
        result[k] = -0.5 * np.sum((image - np.squeeze(rendered.image))**2 / variance)
    np.save(file, result)
    return points, result


def smoothed(points, values):
    """At each point, of a parabola that is fitted to its neighbours."""
    width = 2 / np.sqrt(len(points))
    result = np.empty_like(values)
    for k, point in enumerate(points):
        near = np.flatnonzero(np.abs(points - point).max(1) < 3 * width)
        way = points[near] - point
        weight = np.exp(-0.5 * np.sum((way / width)**2, 1))
        design = np.column_stack([np.ones(len(near)), way, way**2, way[:, :1] * way[:, 1:]])
        gram = design.T * weight @ design + 1e-9 * np.eye(design.shape[1])
        result[k] = np.linalg.solve(gram, design.T * weight @ values[near])[0]
    return result


def moments(points, weights):
    weights = weights / weights.sum()
    mean = weights @ points
    covariance = (points - mean).T * weights @ (points - mean)
    deviation = np.sqrt(np.diag(covariance))
    intervals = []
    for i in range(points.shape[1]):
        order = np.argsort(points[:, i])
        intervals.append(np.interp([0.025, 0.975], np.cumsum(weights[order]), points[order, i]))
    return mean, deviation, np.array(intervals), weights @ (points < 0.5), covariance[0, 1] / deviation.prod()


def picture(file, ranges, title, direct, samples):
    side, gap = 260, 60
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{2 * side + 3 * gap}" height="{side + 2 * gap}" font-family="sans-serif" '
             f'font-size="13"><rect width="100%" height="100%" fill="white"/><text x="{gap}" y="24">{title}</text>']
    for k, (what, points) in enumerate((('direct sampling', direct), ('itn invert --method posterior', samples))):
        left = gap + k * (side + gap)
        parts.append(f'<rect x="{left}" y="{gap}" width="{side}" height="{side}" fill="none" stroke="#888"/>'
                     f'<text x="{left}" y="{gap - 8}">{what}</text>')
        parts += [f'<circle cx="{left + side * x:.1f}" cy="{gap + side * (1 - y):.1f}" r="1.3" fill="#1f5fa8" fill-opacity="0.4"/>'
                  for x, y in points]
        x, y = ranges
        parts.append(f'<text x="{left}" y="{gap + side + 18}">{x.name}: {x.value(0):g} to {x.value(1):g}</text>'
                     f'<text x="{left}" y="{gap + side + 36}">{y.name}, upwards: {y.value(0):g} to {y.value(1):g}</text>')
    file.write_text(''.join(parts) + '</svg>\n')


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('-o', '--output', type=pathlib.Path, required=True)
    parser.add_argument('--materials', type=int, default=10000)
    parser.add_argument('--only', choices=cases)
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    for name, case in cases.items():
        if options.only not in (None, name):
            continue
        folder = options.output / name.replace(' ', '_')
        folder.mkdir(exist_ok=True)
        ranges = [Range(parameter, *ends) for parameter, ends in case['parameters'].items()]
        photo = photo_of(case)
        itn.write_exr(folder / 'photo.exr', {'Y': photo[0], 'stderr.Y': photo[1]})
        points, values = likelihoods(case, photo, ranges, options.materials, folder / f'{options.materials}.npy')
        values = smoothed(points, values)
        weights = np.exp(values - values.max())
        found = itn.invert(loaded(case), folder / 'photo.exr', [r.name for r in ranges], method='posterior', range=case['parameters'],
                           output=folder / 'fit')
        with open(folder / 'fit/samples.csv', newline='') as file:
            rows = list(csv.DictReader(file))
        samples = np.array([[r.share(float(row[r.name])) for r in ranges] for row in rows])
        effective = weights.sum()**2 / np.sum(weights**2)
        print(f'{name}: {case["title"]}. {effective:.0f} of {len(points)} renderings count; {" ".join(found.verdict)}')
        for what, (mean, deviation, intervals, lower, correlation) in (('direct', moments(points, weights)),
                                                                      ('posterior', moments(samples, np.ones(len(samples))))):
            for i, r in enumerate(ranges):
                low, high = r.value(intervals[i])
                print(f'  {what:9} {r.name:15} {r.value(mean[i]):8.4g} ({low:.4g} to {high:.4g}), deviation {deviation[i]:.4f} of the range, '
                      f'{lower[i]:.2f} of it in its lower half'
                      + (f', correlation {correlation:+.3f}' if i == 0 else ''))
        drawn = points[np.random.default_rng(1).choice(len(points), 1000, p=weights / weights.sum())]
        picture(folder / 'posterior.svg', ranges, case['title'], drawn, samples[::max(1, len(samples) // 1000)])


if __name__ == '__main__':
    main()
