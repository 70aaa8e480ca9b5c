"""What `itn gradient` by a texture is compared with: the same gradient in Mitsuba 3 (tools/peers installs it).

    gradient_mitsuba.py SCENE TARGET GRADIENT... [-D name=value ...] [--spp 64] [--runs 3] [--seed 0]

The mean squared difference between prb's image of the scene and TARGET, an image by itn render, differentiated by the
texels of the scene's one bitmap. GRADIENT: what `itn gradient` wrote for it, with other seeds. Prints the seconds of each run after the first,
which compiles; for both programs the size of the mean gradient and the noise of one, root sums of squares over texels; and how far
the two means are apart.
"""
import argparse
import re
import time

import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant('llvm_ad_rgb')
mi.set_log_level(mi.LogLevel.Error)

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument('scene')
parser.add_argument('target')
parser.add_argument('gradient', nargs='+')
parser.add_argument('-D', action='append', default=[], metavar='name=value')
parser.add_argument('--spp', type=int, default=64)
parser.add_argument('--runs', type=int, default=3)
parser.add_argument('--seed', type=int, default=0)
options = parser.parse_args()


def image(file):
    bitmap = mi.Bitmap(file)
    names = [field.name for field in bitmap.struct_()]
    return np.ascontiguousarray(np.array(bitmap)[:, :, [names.index(c) for c in 'RGB']])


scene = mi.load_file(options.scene, **dict(definition.split('=', 1) for definition in options.D))
with open(options.scene) as source:
    depths = dict(re.findall(r'name="(max_depth|rr_depth)" value="(-?\d+)"', source.read()))
integrator = mi.load_dict({'type': 'prb', **{name: int(value) for name, value in depths.items()}})
target = mi.TensorXf(image(options.target))
parameters = mi.traverse(scene)
key = next(key for key in parameters.keys() if key.endswith('.data') and 'bsdf' in key)


def gradient(seed):
    texels = mi.TensorXf(parameters[key])
    dr.enable_grad(texels)
    parameters[key] = texels
    parameters.update()
    loss = dr.mean(dr.square(mi.render(scene, parameters, integrator=integrator, spp=options.spp, seed=seed) - target),
                   axis=None)
    dr.backward(loss)
    result = np.array(dr.grad(texels))
    parameters[key] = mi.TensorXf(dr.detach(texels))
    parameters.update()
    return result


def describe(name, gradients):
    mean = sum(gradients) / len(gradients)
    noise = np.sqrt(sum(np.sum((g - mean)**2) for g in gradients) / max(1, len(gradients) - 1))
    print(f'{name}: size {np.linalg.norm(mean):.4g}, noise of one {noise:.4g}')
    return mean


gradient(options.seed)
theirs = []
for run in range(options.runs):
    start = time.perf_counter()
    theirs.append(gradient(options.seed + 1 + run))
    print(f'{time.perf_counter() - start:.3f} s')
apart = describe('Mitsuba', theirs) - describe('itn', [image(file) for file in options.gradient])
print(f'apart: {np.linalg.norm(apart):.4g}')
