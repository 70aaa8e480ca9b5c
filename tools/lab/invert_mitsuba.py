"""What `itn invert --method adam` is compared with: the same inversion in Mitsuba 3 (tools/peers installs it).

    invert_mitsuba.py SCENE TARGET [-D name=value ...] [--iterations 200] [--spp 16] [--rate 0.05] [--seed 0]

Finds sigma_t, albedo and g of the scene's one medium (single numbers, as in scenes/gallery/translucent_blob.xml) from TARGET,
an image by itn render: prbvolpath, the mean squared difference, Adam over log sigma_t, logit albedo and logit (1 + g) / 2
with a rate that falls as half a cosine wave, fresh samples in each iteration, others for the gradient than for the image
(Mitsuba's own way). Prints the parameters every tenth iteration with the seconds so far; the first iteration, which compiles,
is made twice and counted once.
"""
import argparse
import math
import re
import time

import drjit as dr
import mitsuba as mi

mi.set_variant('llvm_ad_rgb')
mi.set_log_level(mi.LogLevel.Error)

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument('scene')
parser.add_argument('target')
parser.add_argument('-D', action='append', default=[], metavar='name=value')
parser.add_argument('--iterations', type=int, default=200)
parser.add_argument('--spp', type=int, default=16)
parser.add_argument('--rate', type=float, default=0.05)
parser.add_argument('--seed', type=int, default=0)
options = parser.parse_args()

scene = mi.load_file(options.scene, **dict(definition.split('=', 1) for definition in options.D))
with open(options.scene) as source:
    depths = dict(re.findall(r'name="(max_depth|rr_depth)" value="(-?\d+)"', source.read()))
integrator = mi.load_dict({'type': 'prbvolpath', **{name: int(value) for name, value in depths.items()}})
channels = dict(mi.Bitmap(options.target).split())
target = mi.TensorXf(channels['<root>'] if '<root>' in channels else mi.Bitmap(options.target))[:, :, :1]

parameters = mi.traverse(scene)
keys = [next(key for key in parameters.keys() if key.endswith(end))
        for end in ('sigma_t.value.value', 'albedo.value.value', 'phase_function.g')]


def to_coordinates(sigma_t, albedo, g):
    return [math.log(sigma_t), math.log(albedo / (1 - albedo)), math.log((1 + g) / (1 - g))]


def logistic(x):
    return 1 / (1 + dr.exp(-x))


def set_parameters(optimizer):
    values = dr.exp(optimizer['0']), logistic(optimizer['1']), 2 * logistic(optimizer['2']) - 1
    for key, value in zip(keys, values):
        parameters[key] = type(parameters[key])(value)
    parameters.update()
    return [float(value[0]) for value in values]


start = to_coordinates(*[float(dr.ravel(parameters[key])[0]) for key in keys])


def fresh_optimizer():
    optimizer = mi.ad.Adam(lr=options.rate)
    for i, coordinate in enumerate(start):
        optimizer[str(i)] = mi.Float(coordinate)
    return optimizer


def step(optimizer, iteration):
    optimizer.set_learning_rate(options.rate * 0.5 * (1 + math.cos(math.pi * iteration / options.iterations)))
    set_parameters(optimizer)
    seed = options.seed + 2 * iteration
    image = mi.render(scene, parameters, integrator=integrator, spp=options.spp, seed=seed, seed_grad=seed + 1)
    loss = dr.mean(dr.square(image - target), axis=None)
    dr.backward(loss)
    optimizer.step()
    return float(loss.array[0])


step(fresh_optimizer(), 0)
optimizer = fresh_optimizer()
begin = time.perf_counter()
for iteration in range(options.iterations):
    loss = step(optimizer, iteration)
    if (iteration + 1) % 10 == 0:
        sigma_t, albedo, g = set_parameters(optimizer)
        print(f'{iteration + 1:4d}  {time.perf_counter() - begin:7.1f} s  loss {loss:.4g}  sigma_t {sigma_t:.4g}  '
              f'albedo {albedo:.4f}  g {g:.4f}', flush=True)
