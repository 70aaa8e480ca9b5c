"""Writes data/layered.json: what plane-parallel stacks of layers reflect and transmit, without random numbers.

    python3 tests/transport/layered_slabs.py            # needs numpy and scipy
    python3 tests/transport/layered_slabs.py --check    # against data/transport.json, and with other quadratures

Independent of the renderer, and of the codes behind data/transport.json. Double precision; radiances at the nodes of a Gauss
quadrature of each hemisphere, averaged over azimuth; Henyey-Greenstein's phase function as a sum of Legendre polynomials. The
layers' reflection and transmission come from the exponential of the transport equation's matrix for a layer so thin that it
is well conditioned, then by doubling; stacks by adding (van de Hulst 1980, Multiple Light Scattering, chapter 4). Where the
outermost faces are dielectric, the quadrature is split at the critical angle, and radiance is over n^2.

By reciprocity the share R(theta) of a beam that comes back is the radiance that leaves along the beam under uniform light of
radiance 1 from above, and T(theta), of what passes, that under light from below: additional nodes of weight 0 stand in the
directions that are looked along. Derivatives are central differences of the fourth order.
"""
import json
import os
import sys

import numpy as np
from scipy.linalg import expm

HERE = os.path.dirname(os.path.abspath(__file__))
ANGLES = (0, 60)  # outside [degree]
# The layers from the top: thickness, sigma_t, albedo, g.
STACKS = {
    'layers': {'n': 1.0, 'layers': {'skin': (0.3, 4, 0.9, 0.8), 'fat': (0.5, 1, 0.6, 0.3), 'bone': (0.2, 10, 0.98, -0.2)}},
    # scenes/test/layers.vol and layers_albedo.vol: one phase function throughout
    'layers_grid': {'n': 1.0, 'layers': {'skin': (0.3, 4, 0.9, 0.6), 'fat': (0.5, 1, 0.6, 0.6), 'bone': (0.2, 10, 0.98, 0.6)}},
    # a layer within another one, behind dielectric faces
    'layers_dielectric': {'n': 1.4, 'layers': {'peel': (0.2, 3, 0.95, 0.7), 'flesh': (0.6, 8, 0.8, 0.5), 'peel ': (0.2, 3, 0.95, 0.7)}},
}


def fresnel(cosine, n):
    """Unpolarised reflectance for light that arrives inside at this cosine; 1 where it is totally reflected."""
    outside = 1 - n * n * (1 - cosine**2)
    if outside <= 0:
        return 1.0
    t = np.sqrt(outside)
    s, p = (n * cosine - t) / (n * cosine + t), (n * t - cosine) / (n * t + cosine)
    return (s * s + p * p) / 2


class Directions:
    def __init__(self, n, half):
        """half: nodes of each of the two parts of a hemisphere."""
        x, w = np.polynomial.legendre.leggauss(half)
        edge = np.sqrt(1 - 1 / n**2) if n > 1 else 0.5
        self.n = n
        self.half = half
        seen = np.sqrt(1 - (np.sin(np.radians(ANGLES)) / n) ** 2)
        self.mu = np.concatenate([edge * (1 + x) / 2, edge + (1 - edge) * (1 + x) / 2, seen])
        self.weight = np.concatenate([edge * w / 2, (1 - edge) * w / 2, 0 * seen])
        self.reflected = np.array([fresnel(mu, n) for mu in self.mu]) if n > 1 else 0 * self.mu

    def layer(self, thickness, sigma_t, albedo, g):
        """Operators of reflection and transmission on radiances at the nodes."""
        size = len(self.mu)
        orders = np.arange(self.half)  # products of two are integrated exactly
        legendre = np.array([np.polynomial.legendre.Legendre.basis(l)(self.mu) for l in orders])
        share = (orders + 0.5) * g**orders
        forward = (legendre.T * share) @ legendre
        backward = (legendre.T * (share * (-1.0) ** orders)) @ legendre
        stays = (albedo * forward * self.weight - np.eye(size)) / self.mu[:, None]
        turns = albedo * backward * self.weight / self.mu[:, None]
        doublings = max(0, int(np.ceil(np.log2(sigma_t * thickness / self.mu.min()))))
        depth = sigma_t * thickness / 2**doublings
        # d/dz (down, up) = ((stays, turns), (-turns, -stays)) (down, up)
        m = expm(depth * np.block([[stays, turns], [-turns, -stays]]))
        back = np.linalg.inv(m[size:, size:])
        layer = (-back @ m[size:, :size], m[:size, :size] - m[:size, size:] @ back @ m[size:, :size])
        both = (*layer, *layer)  # from above, from below
        for _ in range(doublings):
            both = stacked(both, both)
        return both

    def face(self):
        """A dielectric face, from inside of it alone: what comes from outside is no radiance at the nodes."""
        return np.diag(self.reflected)


def stacked(a, b):
    """a upon b; each: reflection and transmission from above, then from below."""
    eye = np.eye(len(a[0]))
    between = np.linalg.inv(eye - a[2] @ b[0])  # of what goes down between them
    rising = np.linalg.inv(eye - b[0] @ a[2])
    return (a[0] + a[3] @ b[0] @ between @ a[1], b[1] @ between @ a[1],
            b[2] + b[1] @ a[2] @ rising @ b[3], a[3] @ rising @ b[3])


def seen(layers, n, half=96):
    """R and T at each of ANGLES."""
    d = Directions(n, half)
    whole = d.layer(*layers[0])
    for layer in layers[1:]:
        whole = stacked(whole, d.layer(*layer))
    reflect = d.face()
    eye = np.eye(len(d.mu))
    enters = 1 - d.reflected  # uniform light of radiance 1, over n^2
    zero = np.zeros_like(enters)

    def inside(from_above, from_below):
        # down = from_above + F up; up at the top = R down + T' rising; rising = from_below + F falling
        size = len(d.mu)
        # unknown: down at the top, rising at the bottom
        system = np.block([[eye - reflect @ whole[0], -reflect @ whole[3]], [-reflect @ whole[1], eye - reflect @ whole[2]]])
        x = np.linalg.solve(system, np.concatenate([from_above, from_below]))
        return whole[0] @ x[:size] + whole[3] @ x[size:]  # up at the top

    result = {}
    for k, angle in enumerate(ANGLES):
        at = len(d.mu) - len(ANGLES) + k
        result[f'R{angle}'] = d.reflected[at] + enters[at] * inside(enters, zero)[at]
        result[f'T{angle}'] = enters[at] * inside(zero, enters)[at]
    return result


def derivatives(layers, names, n):
    """By each parameter of each layer; layers of one name (spaces aside) move together."""
    result = {}
    for name in dict.fromkeys(name.strip() for name in names):
        for index, parameter in ((1, 'sigma_t'), (2, 'albedo'), (3, 'g')):
            def at(offset):
                moved = [list(layer) for layer in layers]
                for layer, of in zip(moved, names):
                    if of.strip() == name:
                        layer[index] += offset
                return seen(moved, n)
            h = 2e-3
            values = {k: at(k * h) for k in (-2, -1, 1, 2)}
            result[f'{name}.{parameter}'] = {
                key: (8 * (values[1][key] - values[-1][key]) - (values[2][key] - values[-2][key])) / (12 * h)
                for key in values[1]}
    return result


def check():
    with open(os.path.join(HERE, 'data/transport.json'), encoding='utf-8') as f:
        rows = json.load(f)['slab']
    worst = 0
    for row in rows:
        if row['tau'] == 'inf' or row['tau'] > 50 or abs(row['g']) > 0.9:
            continue
        halves = [(0.5, row['tau'], row['albedo'], row['g'])] * 2
        for key, value in seen(halves, row['n']).items():
            worst = max(worst, abs(value - row['value'][key]))
    print(f'{len(rows)} slabs of transport.json, each as two layers: largest difference {worst:.1e}')
    for name, stack in STACKS.items():
        layers = list(stack['layers'].values())
        one, other = seen(layers, stack['n']), seen(layers, stack["n"], 128)
        print(f'{name}: 256 nodes instead of 192 change', f'{max(abs(one[k] - other[k]) for k in one):.1e}')


def main():
    if '--check' in sys.argv:
        return check()
    rows = {'source': 'tests/transport/layered_slabs.py', 'conventions': 'as of transport.json; thickness, sigma_t, albedo, g a layer'}
    for name, stack in STACKS.items():
        layers = list(stack['layers'].values())
        rounded = lambda values: {k: float(f'{v:.9g}') for k, v in values.items()}
        rows[name] = {'n': stack['n'], 'layers': {k.strip() + ("'" if k != k.strip() else ''): v for k, v in stack['layers'].items()},
                      'value': rounded(seen(layers, stack['n'])),
                      'd': {k: rounded(v) for k, v in derivatives(layers, list(stack['layers']), stack['n']).items()}}
    with open(os.path.join(HERE, 'data/layered.json'), 'w', encoding='utf-8') as f:
        json.dump(rows, f, indent=1)
        f.write('\n')


if __name__ == '__main__':
    main()
