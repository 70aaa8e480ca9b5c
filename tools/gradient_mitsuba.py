"""What `itn gradient` by a texture is compared with: the same gradient in Mitsuba 3 (tools/peers installs it).

    gradient_mitsuba.py SCENE TARGET GRADIENT [-D name=value ...] [--spp 64] [--runs 3] [--seed 0]

The mean squared difference between prb's image of the scene and TARGET, an image by itn render, differentiated by the
texels of the scene's one bitmap. GRADIENT is what `itn gradient` wrote for it. Prints the seconds of each run after the first, which compiles,
and how far both gradients, the mean over the runs here, are apart, over their size.
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
parser.add_argument('gradient')
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


gradient(options.seed)
total = 0
for run in range(options.runs):
    start = time.perf_counter()
    total = total + gradient(options.seed + 1 + run)
    print(f'{time.perf_counter() - start:.3f} s')
own = image(options.gradient)
theirs = total / options.runs
print(f'size {np.linalg.norm(theirs):.4g} (Mitsuba), {np.linalg.norm(own):.4g} (itn), '
      f'difference {np.linalg.norm(own - theirs) / np.linalg.norm(theirs):.3g}')
