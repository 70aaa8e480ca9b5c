"""Is a smoke recovered from pictures of it? Makes one, renders it from all sides, and has `itn invert` find its voxels.

    recover_smoke.py FOLDER [--itn build/bin/itn] [--voxels 32] [--views 8] [--size 64] [--spp 16] [--iterations 100]
                     [--mitsuba RATE ...]

The smoke is a procedural plume in a cube, lit by a sky and a lamp; the sensors stand around it, one more, which the inversion
does not see, between two of them. The grid starts nearly empty. Prints the error of the density, root mean square over that of
the smoke itself, and that of the held-out view, of the start and of what was found. What is there in FOLDER is kept: the same
command goes on, but its seconds are then those of the rest.

With --mitsuba also Mitsuba's prbvolpath (needs Python's mitsuba and numpy: tools/peers), once with each learning rate: the same
loss, smoothness, samples and Adam, whose rate falls as half a cosine wave over as many CPU seconds as itn has used; what Mitsuba
compiles first is not counted. Its voxels stay at 0.001 at least, since it has no derivative of what a voxel of 0 would scatter,
and Adam's small number is 1e-15, far below the derivatives by voxels.
"""
import argparse
import array
import json
import math
import pathlib
import resource
import struct
import subprocess
import time

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument('folder', type=pathlib.Path)
parser.add_argument('--itn', default='build/bin/itn')
parser.add_argument('--voxels', type=int, default=32)
parser.add_argument('--views', type=int, default=8)
parser.add_argument('--size', type=int, default=64)
parser.add_argument('--spp', type=int, default=16)
parser.add_argument('--target-spp', type=int, default=256)
parser.add_argument('--iterations', type=int, default=100)
parser.add_argument('--learning-rate', type=float, default=0.3)
parser.add_argument('--smoothness', type=float, default=1e-5)
parser.add_argument('--start', type=float, default=0.1)
parser.add_argument('--mitsuba', type=float, nargs='+', default=[], metavar='RATE')
options = parser.parse_args()
n = options.voxels


def plume(x, y, z):
    """Density at a place of the unit cube: a column that widens and turns, in puffs."""
    turn = 5 * z
    dx, dy = x - 0.5 - 0.12 * math.cos(turn), y - 0.5 - 0.12 * math.sin(turn)
    width = 0.1 + 0.12 * z
    puffs = 0.6 + 0.4 * math.sin(19 * z + 7 * dx) * math.cos(13 * dy + 3 * z)
    inside = 1 - (dx * dx + dy * dy) / (width * width)
    return 8 * puffs * inside if inside > 0 and 0.06 < z < 0.94 else 0.0


def write_grid(file, values):
    with open(file, 'wb') as out:
        out.write(b'VOL\x03' + struct.pack('<5i6f', 1, n, n, n, 1, 0, 0, 0, 1, 1, 1))
        out.write(array.array('f', values).tobytes())


def read_grid(file):
    values = array.array('f')
    values.frombytes(pathlib.Path(file).read_bytes()[48:])
    return values


def sensor(turn, up):
    angle = 2 * math.pi * turn
    place = (5 * math.cos(angle) * math.cos(up), 5 * math.sin(angle) * math.cos(up), 5 * math.sin(up))
    return f'''<sensor type="perspective"><float name="fov" value="32"/>
    <transform name="to_world"><lookat origin="{place[0]}, {place[1]}, {place[2]}" target="0, 0, 0" up="0, 0, 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="{options.size}"/><integer name="height" value="{options.size}"/>
      <rfilter type="box"/></film></sensor>'''


def scene(grid):
    sensors = [sensor(k / options.views, 0.5 * (-1) ** k) for k in range(options.views)]
    sensors.append(sensor(0.5 / options.views, 0.1))
    return f'''<scene version="3.0.0">
  <integrator type="volpath"><integer name="max_depth" value="32"/></integrator>
  {"".join(sensors)}
  <emitter type="constant"><rgb name="radiance" value="0.3, 0.4, 0.6"/></emitter>
  <emitter type="directional"><vector name="direction" x="-1" y="0.5" z="-1.5"/>
    <rgb name="irradiance" value="3, 2.6, 2"/></emitter>
  <shape type="cube"><bsdf type="null"/>
    <medium name="interior" type="heterogeneous" id="smoke">
      <volume type="gridvolume" name="sigma_t"><string name="filename" value="{grid}"/>
        <transform name="to_world"><scale value="2"/><translate x="-1" y="-1" z="-1"/></transform></volume>
      <float name="albedo" value="0.8"/>
    </medium></shape>
</scene>'''


def itn(*arguments):
    command = [options.itn, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode not in (0, 1):  # 1: what was found does not fit within the noise
        done.check_returncode()
    return json.loads(done.stdout or '{}')


def rms(a, b):
    return math.sqrt(sum((x - y) ** 2 for x, y in zip(a, b)) / len(b))


def children_s():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def by_mitsuba(targets, rate, budget):
    """The voxels that Mitsuba finds within so many CPU seconds, and in how many iterations."""
    import drjit as dr
    import mitsuba as mi
    mi.set_variant('llvm_ad_rgb')
    mi.set_log_level(mi.LogLevel.Error)
    view = mi.load_file(str(options.folder / 'start.xml'))
    integrator = mi.load_dict({'type': 'prbvolpath', 'max_depth': 32})
    images = [mi.TensorXf(dict(mi.Bitmap(str(target)).split())['<root>'])[:, :, :3] for target in targets]
    parameters = mi.traverse(view)
    key, = [key for key in parameters.keys() if key.endswith('.sigma_t.data')]
    start = mi.TensorXf(parameters[key])
    pairs = 3 * n * n * (n - 1)
    for attempt in range(2):  # the first compiles
        optimizer = mi.ad.Adam(lr=rate, epsilon=1e-15)
        optimizer['voxels'] = mi.TensorXf(start)
        begin, done, iteration = time.process_time(), 0, 0
        while done < 1 and not (attempt == 0 and iteration == 1):
            optimizer.set_learning_rate(rate * 0.5 * (1 + math.cos(math.pi * done)))
            parameters[key] = optimizer['voxels']
            parameters.update()
            for k, image in enumerate(images):
                seed = 2 * (iteration * len(images) + k)
                difference = mi.render(view, parameters, sensor=k, integrator=integrator, spp=options.spp, seed=seed,
                                       seed_grad=seed + 1)[:, :, :3] - image
                dr.backward(dr.mean(dr.square(difference), axis=None) / len(images))
            v = optimizer['voxels']
            rough = (dr.sum(dr.square(v[1:] - v[:-1]), axis=None) + dr.sum(dr.square(v[:, 1:] - v[:, :-1]), axis=None) +
                     dr.sum(dr.square(v[:, :, 1:] - v[:, :, :-1]), axis=None))
            dr.backward(options.smoothness / pairs * rough)
            optimizer.step()
            optimizer['voxels'] = dr.maximum(optimizer['voxels'], 1e-3)
            dr.eval(optimizer['voxels'])
            dr.sync_thread()
            iteration += 1
            done = (time.process_time() - begin) / budget
    return array.array('f', optimizer['voxels'].numpy().ravel().tolist()), iteration


options.folder.mkdir(parents=True, exist_ok=True)
places = [(i + 0.5) / n for i in range(n)]
truth = array.array('f', [plume(x, y, z) for z in places for y in places for x in places])
write_grid(options.folder / 'truth.vol', truth)
write_grid(options.folder / 'start.vol', [options.start] * n**3)
for name in ['truth', 'start']:
    (options.folder / f'{name}.xml').write_text(scene(f'{name}.vol'))
targets = []
for k in range(options.views + 1):
    targets.append(options.folder / f'view_{k}.exr')
    if not targets[-1].exists():
        itn('render', options.folder / 'truth.xml', '--sensor', k, '--spp', options.target_spp, '--seed', 1000 + k, '-o', targets[-1],
            '--quiet')
asked = []
for k in range(options.views):
    asked += ['--target', targets[k], '--sensor', k]
start, cpu = time.time(), children_s()
result = itn('invert', options.folder / 'start.xml', *asked, '--parameter', 'smoke.sigma_t', '--method', 'adam', '--iterations',
             options.iterations, '--spp', options.spp, '--learning-rate', options.learning_rate, '--smoothness',
             options.smoothness, '--repeats', 0, '-o', options.folder / 'found', '--quiet', '--json', '-')
seconds, cpu = time.time() - start, children_s() - cpu
print(f'{n}^3 voxels, {options.views} views of {options.size} x {options.size}, {options.iterations} iterations of '
      f'{options.spp} spp: {seconds:.0f} s, {cpu:.0f} s of all cores', flush=True)
print(f"loss of the views: {result['loss_at_start']:.3g} at the start, {result['loss']:.3g} of what was found", flush=True)


def held_out(name):
    """The loss of the view that nobody used; of the smoke itself it is noise."""
    losses = itn('gradient', options.folder / f'{name}.xml', '--target', targets[-1], '--sensor', options.views, '--parameter',
                 'smoke.scale', '--spp', options.target_spp, '--quiet', '--json', '-')
    return losses['loss']


def judge(name, values):
    if name != 'start':
        write_grid(options.folder / f'{name}.vol', values)
        (options.folder / f'{name}.xml').write_text(scene(f'{name}.vol'))
    print(f'{name}: density, rms error over rms {rms(values, truth) / rms(truth, [0] * len(truth)):.3f}; held-out view, mean '
          f'squared error {held_out(name):.3g}', flush=True)


print(f'the smoke itself: held-out view {held_out("truth"):.3g} (noise of the target)')
judge('start', read_grid(options.folder / 'start.vol'))
judge('found', read_grid(options.folder / 'found/smoke.sigma_t.vol'))
for rate in options.mitsuba:
    values, iterations = by_mitsuba(targets[:options.views], rate, cpu)
    print(f'Mitsuba, learning rate {rate:g}: {iterations} iterations in as many seconds of all cores', flush=True)
    judge(f'mitsuba_{rate:g}', values)
