"""The other side of `itn bench --peer mitsuba`: renders scene files in Mitsuba 3 when asked.

One JSON object a line on standard input, {"scene": FILE, "spp": N, "seed": K, "output": FILE}; one answer a line on
standard output, {"seconds": T, "width": W, "height": H}, the image as raw float32 RGB in the output file.
With "gradient": true, prbvolpath renders the image and then differentiates its mean by sigma_t, albedo and g of the scene's
medium; the answer has "gradient", one list of numbers for each of them, and no image is written.
With "texture": NAME, prb does so by the texels of that texture (floor.reflectance), prbvolpath by the voxels of that grid (material.sigma_t),
and the output file has the gradient, raw float32.
The first argument is Mitsuba's variant. Seconds are path tracing alone: the scene is loaded before, once; the caller throws the first run (kernel compilation) away.
"""
import json
import os
import re
import sys
import time

# Whatever Mitsuba prints must not mix with the answers.
answers = os.fdopen(os.dup(1), 'w')
os.dup2(2, 1)


def differentiating(mi, kind, file):
    """The integrator prb or prbvolpath with the file's depths."""
    with open(file) as source:
        depths = dict(re.findall(r'name="(max_depth|rr_depth)" value="(-?\d+)"', source.read()))
    return mi.load_dict({'type': kind, **{name: int(value) for name, value in depths.items()}})


def load_textured(mi, dr, file, texture):
    """The scene, its parameters, where its texels or voxels are among them, and prb or prbvolpath."""
    scene = mi.load_file(file)
    parameters = mi.traverse(scene)
    member = texture.split('.', 1)[1]
    is_grid = member == 'sigma_t'
    # Mitsuba names a surface inside of a shape after the shape, whatever its id
    end = '.sigma_t.data' if is_grid else f'.bsdf.{member}.data'
    key, = [key for key in parameters.keys() if key.endswith(end)]
    dr.enable_grad(parameters[key])
    parameters.update()
    return scene, parameters, {'texels': key}, differentiating(mi, 'prbvolpath' if is_grid else 'prb', file)


def load_differentiable(mi, dr, file):
    """The scene, its parameters by our names, and prbvolpath."""
    scene = mi.load_file(file)
    parameters = mi.traverse(scene)
    keys = {}
    for name, end in {'sigma_t': 'sigma_t.value.value', 'albedo': 'albedo.value.value', 'g': 'phase_function.g'}.items():
        keys[name], = [key for key in parameters.keys() if key.endswith(end)]
        dr.enable_grad(parameters[keys[name]])
    parameters.update()
    return scene, parameters, keys, differentiating(mi, 'prbvolpath', file)


def gradient_of_mean(mi, dr, np, differentiable, job):
    """Of the image's mean, by each of the names; and the seconds that it took."""
    view, parameters, keys, integrator = differentiable
    for key in keys.values():
        dr.set_grad(parameters[key], 0)
    dr.sync_thread()
    start = time.perf_counter()
    dr.backward(dr.mean(mi.render(view, parameters, integrator=integrator, spp=job['spp'], seed=job['seed']), axis=None))
    gradient = {name: np.array(dr.grad(parameters[key])) for name, key in keys.items()}
    dr.sync_thread()
    return gradient, time.perf_counter() - start


def main():
    import drjit as dr
    import mitsuba as mi
    import numpy as np

    mi.set_variant(sys.argv[1])
    mi.set_log_level(mi.LogLevel.Error)
    print(json.dumps({'mitsuba': mi.__version__, 'variant': mi.variant()}), file=answers, flush=True)
    scene, loaded = None, None
    differentiable, differentiable_file = None, None
    textured, textured_file = None, None
    for line in sys.stdin:
        job = json.loads(line)
        if job.get('gradient'):
            if job['scene'] != differentiable_file:
                differentiable, differentiable_file = load_differentiable(mi, dr, job['scene']), job['scene']
            gradient, seconds = gradient_of_mean(mi, dr, np, differentiable, job)
            print(json.dumps({'seconds': seconds,
                              'gradient': {name: values.ravel().tolist() for name, values in gradient.items()}}),
                  file=answers, flush=True)
            continue
        if 'texture' in job:
            if job['scene'] != textured_file:
                textured, textured_file = load_textured(mi, dr, job['scene'], job['texture']), job['scene']
            gradient, seconds = gradient_of_mean(mi, dr, np, textured, job)
            gradient['texels'].astype(np.float32).tofile(job['output'])
            print(json.dumps({'seconds': seconds}), file=answers, flush=True)
            continue
        if job['scene'] != loaded:
            scene, loaded = mi.load_file(job['scene']), job['scene']
        dr.sync_thread()
        start = time.perf_counter()
        image = mi.render(scene, spp=job['spp'], seed=job['seed'])
        dr.eval(image)
        dr.sync_thread()
        seconds = time.perf_counter() - start
        pixels = np.array(image, dtype=np.float32)
        pixels.tofile(job['output'])
        print(json.dumps({'seconds': seconds, 'width': pixels.shape[1], 'height': pixels.shape[0]}),
              file=answers, flush=True)


if __name__ == '__main__':
    main()
