"""Renders the references of scenes/test/mitsuba: SCENE.xml -> SCENE.exr, with Mitsuba 3.

    tools/peers                                       # once: Mitsuba 3.9.1 and LLVM
    export DRJIT_LIBLLVM_PATH=/usr/lib/x86_64-linux-gnu/libLLVM-19.so
    .peers/bin/python tests/transport/make_references.py [SCENE.xml ...]

Where that LLVM is missing: MITSUBA_VARIANT=scalar_rgb, slower (cylinder_instances was made so).
Each scene is rendered in independent passes, each with a seed of its own. The file holds the mean over the passes in
channels R G B, and its standard error, from the spread of the passes, in stderr.R stderr.G stderr.B.
The integrator is the scene's own volpath. For RGB sigma_t volpath takes one channel's density, which has no useful
variance: there either volpathmis, or, where that is heavy-tailed too, three renders with a channel's sigma_t for all three.
Lights that only its particle tracer finds (directionalarea) are rendered by that one.
Mitsuba takes rgb sigma_t in [0, 1] only: the scenes use `scale`.
"""
import glob
import os
import sys
import time

import mitsuba as mi
import numpy as np

FOLDER = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..', 'scenes', 'test', 'mitsuba')
PASSES = 64
SPP = 1024  # a pass
SPP_OF = {'rgb_sigma_t': 2048, 'null_constant': 512, 'dielectric_constant': 512,
          'max_depth': 512, 'rough_shading_normals': 512, 'cylinder_instances': 96, 'checkerboard': 256,
          'lights_surfaces': 512, 'lights_medium': 256, 'lights_rough': 1024, 'lights_textured': 256, 'lights_inside': 512,
          'rayleigh': 512, 'tabulated': 512, 'mixtures': 512, 'thinlens': 256, 'irradiancemeter': 65536, 'distant': 65536,
          'grid_null': 256, 'grid_rgb': 512, 'grid_rough': 512, 'grid_inside': 256, 'grid_phase': 512, 'beams': 2048,
          'blends': 128, 'masks': 128, 'bent_normals': 128, 'fog_open': 512, 'volume_textures': 256}
SPECTRAL_MIS = {'rgb_sigma_t'}
PARTICLES = {'beams'}  # lights that no path finds
CHANNEL_BY_CHANNEL = {'rgb_sigma_t_null', 'grid_rgb'}


def channel_by_channel(scene, **options):
    """The image of a scene with one medium, each channel from a render in which all have its sigma_t."""
    parameters = mi.traverse(scene)
    key, = [k for k in parameters.keys() if k.endswith(('.sigma_t.value.value', '.sigma_t.data'))]
    grid = key.endswith('.data')
    sigma_t = np.array(parameters[key]) if grid else np.array(parameters[key]).ravel()

    def set_to(values):
        parameters[key] = mi.TensorXf(values) if grid else mi.Color3f(*[float(v) for v in values])
        parameters.update()

    channels = []
    for c in range(3):
        set_to(np.repeat(sigma_t[..., c:c + 1], 3, axis=-1))
        channels.append(np.array(mi.render(scene, **options), dtype=np.float64)[:, :, c])
    set_to(sigma_t)
    return np.stack(channels, axis=-1)


def render(path):
    name = os.path.splitext(os.path.basename(path))[0]
    scene = mi.load_file(path)
    integrator = scene.integrator()
    if name in SPECTRAL_MIS:
        integrator = mi.load_dict({'type': 'volpathmis', 'max_depth': 256, 'rr_depth': 5})
    if name in PARTICLES:
        integrator = mi.load_dict({'type': 'ptracer', 'max_depth': 2})
    spp = SPP_OF.get(name, SPP)
    start = time.time()
    mean, square = 0.0, 0.0
    for k in range(PASSES):
        options = {'integrator': integrator, 'spp': spp, 'seed': k}
        if name in CHANNEL_BY_CHANNEL:
            image = channel_by_channel(scene, **options)
        else:
            image = np.array(mi.render(scene, **options), dtype=np.float64)
        delta = image - mean
        mean = mean + delta / (k + 1)
        square = square + delta * (image - mean)
    stderr = np.sqrt(square / (PASSES - 1) / PASSES)
    pixels = np.concatenate([mean, stderr], axis=-1).astype(np.float32)
    names = [prefix + c for prefix in ('', 'stderr.') for c in 'RGB']
    bitmap = mi.Bitmap(pixels, mi.Bitmap.PixelFormat.MultiChannel, channel_names=names)
    bitmap.metadata()['comments'] = f'Mitsuba {mi.__version__}, {mi.variant()}, {PASSES} passes of {spp} spp'
    bitmap.write(os.path.splitext(path)[0] + '.exr')
    lit = mean > 1e-6
    print(f'{name:24s} spp {PASSES}x{spp}  {time.time() - start:6.1f} s  mean {mean.mean((0, 1))}  relative standard '
          f'error: median {np.median((stderr / np.maximum(mean, 1e-9))[lit]):.2%}, '
          f'largest {(stderr / np.maximum(mean, 1e-9))[lit].max():.2%}', flush=True)


def main():
    mi.set_variant(os.environ.get('MITSUBA_VARIANT', 'llvm_ad_rgb'))
    for path in sys.argv[1:] or sorted(glob.glob(os.path.join(FOLDER, '*.xml'))):
        render(path)


if __name__ == '__main__':
    main()
