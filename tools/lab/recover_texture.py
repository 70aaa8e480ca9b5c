#!/usr/bin/env python3
"""A printed translucent ball from 1, 4 and 16 images: its texture, and the medium inside, found by `itn invert`.

    recover_texture.py FOLDER [--itn build/bin/itn] [--images 1 4 16] [--iterations 100] [--spp 8] [--thin] [--known]
                       [--mitsuba]

The paint covers every other square of the wax, so that images show both beside each other. With --thin it hides half of
the wax everywhere: a brighter paint and a brighter wax then look alike, and no optimiser tells them apart.

Needs Python's mitsuba and numpy (tools/peers), if only to read images. Writes scene, targets and results into FOLDER, and prints
a row for each number of images: of the texels that some path has seen the root mean squared difference from the truth at the
start and at the end, which share of them lies within two of the standard errors that itn says, seconds of the clock and of
all cores, and the medium's numbers. With --mitsuba also Mitsuba's prbvolpath with the same optimiser: Adam on texels, log
sigma_t and logit albedo, the same rates, iterations and samples; the first iteration, which compiles, is made twice and
counted once.
"""
import argparse
import json
import math
import pathlib
import resource
import subprocess
import time

import drjit as dr
import mitsuba as mi
import numpy as np

WIDTH, HEIGHT, SIZE = 32, 16, 64
TRUE = {'sigma_t': 8.0, 'albedo': 0.9}
START = {'sigma_t': 4.0, 'albedo': 0.7}

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument('folder', type=pathlib.Path)
parser.add_argument('--itn', default='build/bin/itn')
parser.add_argument('--images', type=int, nargs='+', default=[1, 4, 16])
parser.add_argument('--iterations', type=int, default=100)
parser.add_argument('--spp', type=int, default=8)
parser.add_argument('--mitsuba', action='store_true')
parser.add_argument('--thin', action='store_true', help='paint that hides half of the wax everywhere, in place of squares')
parser.add_argument('--known', action='store_true', help='the medium is known: it starts from the truth and stays')
options = parser.parse_args()
if options.known:
    START = TRUE
mi.set_variant('llvm_ad_rgb')
mi.set_log_level(mi.LogLevel.Error)
options.folder.mkdir(parents=True, exist_ok=True)


def write_ppm(name, texels):
    pixels = np.rint(255 * texels).astype(np.uint8)
    (options.folder / name).write_bytes(b'P6 %d %d 255\n' % pixels.shape[1::-1] + pixels.tobytes())
    return pixels / 255


def painted():
    """Bands and spots of three colours, as 8-bit numbers have them."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    u, v = 2 * math.pi * x / WIDTH, math.pi * y / HEIGHT
    return write_ppm('truth.ppm', np.stack([0.45 + 0.3 * np.sin(3 * u) * np.sin(v), 0.4 + 0.3 * np.cos(4 * v),
                                            0.4 + 0.25 * np.sin(2 * u + 5 * v)], axis=-1))


def sensor(k):
    """The k-th of 16 views from all around, at the points of a Fibonacci spiral."""
    z, turn = 0.8 - 1.6 * ((k * 5) % 16) / 15, k * math.pi * (3 - math.sqrt(5))
    r = math.sqrt(1 - z * z)
    return f'''<sensor type="perspective"><float name="fov" value="34"/>
  <transform name="to_world"><lookat origin="{4 * r * math.cos(turn)}, {4 * r * math.sin(turn)}, {4 * z}"
    target="0, 0, 0" up="0, 0, 1"/></transform>
  <film type="hdrfilm"><integer name="width" value="{SIZE}"/><integer name="height" value="{SIZE}"/>
    <rfilter type="box"/></film><sampler type="independent"/></sensor>'''


def coverage():
    """How much of the wax the paint hides: half of it all over, or all of it in squares that leave as many bare."""
    if options.thin:
        return '<float name="weight" value="0.5"/>'
    return '''<texture type="bitmap" name="weight"><boolean name="raw" value="true"/>
      <string name="filename" value="squares.ppm"/><string name="filter_type" value="nearest"/></texture>'''


def write_scene(images):
    path = options.folder / f'scene_{images}.xml'
    path.write_text(f'''<scene version="3.0.0">
<default name="picture" value="start.ppm"/>
<default name="sigma_t" value="{START['sigma_t']}"/><default name="albedo" value="{START['albedo']}"/>
<integrator type="volpath"><integer name="max_depth" value="64"/><integer name="rr_depth" value="16"/></integrator>
{"".join(sensor(k) for k in range(images))}
<emitter type="constant"><rgb name="radiance" value="0.05, 0.05, 0.05"/></emitter>
<emitter type="point"><point name="position" x="3" y="-3" z="4"/>
  <rgb name="intensity" value="20, 20, 20"/></emitter>
<shape type="sphere" id="ball">
  <bsdf type="blendbsdf">{coverage()}
    <bsdf type="diffuse" id="paint"><texture type="bitmap" name="reflectance"><boolean name="raw" value="true"/>
      <string name="filename" value="$picture"/><string name="format" value="variant"/></texture></bsdf>
    <bsdf type="roughdielectric"><string name="distribution" value="ggx"/><float name="alpha" value="0.3"/></bsdf></bsdf>
  <medium type="homogeneous" name="interior" id="wax"><float name="sigma_t" value="$sigma_t"/>
    <float name="albedo" value="$albedo"/></medium>
</shape></scene>''')
    return path


def itn(*arguments):
    done = subprocess.run([options.itn, *map(str, arguments), '--quiet'])
    if done.returncode not in (0, 1):  # 1: what was found does not fit within the noise
        done.check_returncode()


def read(path):
    channels = dict(mi.Bitmap(str(path)).split())
    return np.array(channels['<root>'] if '<root>' in channels else mi.Bitmap(str(path)))[:, :, :3]


def make_targets(path, images):
    targets = []
    for k in range(images):
        targets.append(options.folder / f'target_{k}.exr')
        if not targets[-1].exists():
            itn('render', path, '--sensor', k, '-D', 'picture=truth.ppm', '-D', f'sigma_t={TRUE["sigma_t"]}', '-D',
                f'albedo={TRUE["albedo"]}', '--spp', 1024, '--seed', 1000 + k, '-o', targets[-1])
    return targets


def children_s():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def by_itn(path, targets, truth):
    out, result = options.folder / f'itn_{len(targets)}', options.folder / f'itn_{len(targets)}.json'
    wanted = [argument for target in targets for argument in ('--target', target)]
    for name in () if options.known else TRUE:
        wanted += ['--parameter', f'wax.{name}']
    begin = children_s()
    itn('invert', path, *wanted, '--parameter', 'paint.reflectance', '--iterations', options.iterations, '--spp',
        options.spp, '-o', out, '--json', result)
    cpu = children_s() - begin
    found, error = read(out / 'paint.reflectance.exr'), read(out / 'paint.reflectance.uncertainty.exr')
    lines = [json.loads(line) for line in (out / 'iterations.jsonl').read_text().splitlines()]
    answer = json.loads(result.read_text())
    seen = np.isfinite(error)
    share = len([line for line in lines if line['repeat'] == 0]) / len(lines)
    return {'texels': found, 'seen': seen, 'within': np.mean((abs(found - truth) < 2 * error)[seen]),
            'numbers': answer['parameters'],
            'seconds': answer['time']['total_s'], 'cpu': cpu, 'share': share}


def by_mitsuba(path, targets):
    scene = mi.load_file(str(path))
    integrator = mi.load_dict({'type': 'prbvolpath', 'max_depth': 64, 'rr_depth': 16})
    images = [mi.TensorXf(read(target)) for target in targets]
    parameters = mi.traverse(scene)
    picture, sigma_t, albedo = (next(key for key in parameters.keys() if key.endswith(end)) for end in
                                ('reflectance.data', 'sigma_t.value.value', 'albedo.value.value'))
    start = mi.TensorXf(parameters[picture])
    seconds = cpu = 0
    for attempt in range(2):  # the first compiles
        optimizer = mi.ad.Adam(lr=0.05)
        optimizer['texels'] = mi.TensorXf(start)
        optimizer['sigma_t'] = mi.Float(math.log(START['sigma_t']))
        optimizer['albedo'] = mi.Float(math.log(START['albedo'] / (1 - START['albedo'])))
        for iteration in range(1 if attempt == 0 else options.iterations):
            begin, cpu_begin = time.time(), time.process_time()
            optimizer.set_learning_rate(0.05 * 0.5 * (1 + math.cos(math.pi * iteration / options.iterations)))
            optimizer['texels'] = dr.clip(optimizer['texels'], 1e-3, 1)
            parameters[picture] = optimizer['texels']
            parameters[sigma_t] = type(parameters[sigma_t])(dr.exp(optimizer['sigma_t']))
            parameters[albedo] = type(parameters[albedo])(1 / (1 + dr.exp(-optimizer['albedo'])))
            parameters.update()
            for k, target in enumerate(images):
                seed = 2 * (iteration * len(images) + k)
                image = mi.render(scene, parameters, sensor=k, integrator=integrator, spp=options.spp, seed=seed,
                                  seed_grad=seed + 1)
                dr.backward(dr.mean(dr.square(image[:, :, :3] - target), axis=None) / len(images))
            optimizer.step()
            dr.eval(optimizer['texels'])
            dr.sync_thread()
            seconds += time.time() - begin if attempt == 1 else 0
            cpu += time.process_time() - cpu_begin if attempt == 1 else 0
    return {'texels': np.array(optimizer['texels']).reshape(HEIGHT, WIDTH, 3), 'seconds': seconds, 'cpu': cpu,
            'sigma_t': math.exp(float(optimizer['sigma_t'][0])),
            'albedo': 1 / (1 + math.exp(-float(optimizer['albedo'][0])))}


def rms(texels, truth, seen):
    return math.sqrt(np.mean(np.square(texels - truth)[seen]))


truth = painted()
write_ppm('squares.ppm', np.repeat((np.indices((2 * HEIGHT, 2 * WIDTH)).sum(axis=0) % 2)[:, :, None], 3, axis=2))
write_ppm('start.ppm', np.full((HEIGHT, WIDTH, 3), 0.5))
targets = make_targets(write_scene(max(options.images)), max(options.images))
print('images  seen  rms at start  rms at end  within 2 errors  seconds (cores)   the medium')
for images in options.images:
    path = write_scene(images)
    own = by_itn(path, targets[:images], truth)
    numbers = '   '.join(f"{name} {found['value']:.4g} ({found['low']:.4g} to {found['high']:.4g})"
                         for name, found in own['numbers'].items())
    print(f"{images:6d} {own['seen'].mean():5.2f} {rms(np.full_like(truth, 128 / 255), truth, own['seen']):13.4f} "
          f"{rms(own['texels'], truth, own['seen']):11.4f} {own['within']:16.2f} "
          f"{own['seconds'] * own['share']:8.1f} ({own['cpu'] * own['share']:.1f})   {numbers}", flush=True)
    if options.mitsuba:
        other = by_mitsuba(path, targets[:images])
        print(f"{'mitsuba':>12} {rms(other['texels'], truth, own['seen']):25.4f} {'':16} {other['seconds']:8.1f} "
              f"({other['cpu']:.1f})   sigma_t {other['sigma_t']:.4g}   albedo {other['albedo']:.4g}", flush=True)
