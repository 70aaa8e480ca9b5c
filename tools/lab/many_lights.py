"""What do many lights cost? Time to the same error with 100 lamps over that with one of the same power.

    many_lights.py [--itn build/bin/itn] [--lamps 100] [--runs 5] [--spp 64]

Lamps are squares that shine, under the ceiling of a room with balls on its floor, or of the same room full of fog: one, or many
that share its area, side by side in its place or spread over the ceiling, beside one that is dimmer and as wide as that. They are
not seen themselves, since the edges of their pictures would be most of the error. That is the standard error of the image's
mean, over the mean, and goes with the root of the time; the time is the least of some runs, taken in turn.
"""
import argparse
import json
import math
import pathlib
import subprocess
import tempfile

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument('--itn', default='build/bin/itn')
parser.add_argument('--lamps', type=int, default=100)
parser.add_argument('--runs', type=int, default=5)
parser.add_argument('--spp', type=int, default=64)
options = parser.parse_args()
SIDE, WIDE = 1.0, 4.0  # of the one lamp, and of where many are spread


def lamp(x, y, half, radiance=12):
    return f'''<shape type="rectangle"><transform name="to_world"><scale x="{half}" y="{half}"/><rotate x="1" angle="180"/>
    <translate x="{x}" y="{y}" z="2.9"/></transform><bsdf type="diffuse"/>
    <emitter type="area"><float name="radiance" value="{radiance}"/></emitter></shape>\n'''


def lamps(count, spread):
    rows = math.isqrt(count)
    if rows * rows != count:
        raise SystemExit(f'--lamps {count}: need a square')
    half = SIDE / 2 / rows
    places = [spread * ((k + 0.5) / rows - 0.5) for k in range(rows)]
    return ''.join(lamp(x, y, half) for x in places for y in places)


def scene(lights, fog):
    balls = ''.join(f'''<shape type="sphere"><point name="center" x="{x}" y="{y}" z="0.5"/><float name="radius" value="0.5"/>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.7, 0.6, 0.4"/></bsdf></shape>\n''' for x in (-1.2, 0.4, 1.6) for y in (-1, 0.8))
    medium = '''<shape type="cube"><transform name="to_world"><scale x="2.4" y="2.4" z="1.3"/><translate z="1.4"/></transform>
    <bsdf type="null"/><medium type="homogeneous" name="interior"><float name="sigma_t" value="0.5"/>
    <float name="albedo" value="0.9"/></medium></shape>''' if fog else ''
    return f'''<scene version="3.0.0"><integrator type="volpath"><integer name="max_depth" value="8"/>
    <boolean name="hide_emitters" value="true"/></integrator>
    <sensor type="perspective"><float name="fov" value="50"/>
    <transform name="to_world"><lookat origin="0, -6.5, 2" target="0, 0, 1" up="0, 0, 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="128"/><integer name="height" value="96"/></film></sensor>
    <shape type="rectangle"><transform name="to_world"><scale value="3"/></transform><bsdf type="diffuse"/></shape>
    {balls}{medium}{lights}</scene>'''


def measure(file, seed):
    command = [options.itn, 'render', str(file), '--spp', str(options.spp), '--seed', str(seed), '--json', '-', '--quiet', '-o',
               str(file.with_suffix('.exr'))]
    result = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    return result['time']['render_s'], sum(result['mean_stderr']) / sum(result['mean']), sum(result['mean']) / 3


with tempfile.TemporaryDirectory() as folder:
    print(f'{"":24} {"time":>8} {"error":>9} {"mean":>8} {"cost at the same error":>24}')
    for room, fog in (('room', False), ('fog', True)):
        cases = {'one lamp': lamps(1, SIDE), f'{options.lamps}, side by side': lamps(options.lamps, SIDE),
                 'one, wide': lamp(0, 0, WIDE / 2, 12 * (SIDE / WIDE)**2), f'{options.lamps}, spread': lamps(options.lamps, WIDE)}
        files = {}
        for k, (name, lights) in enumerate(cases.items()):
            files[name] = pathlib.Path(folder) / f'{room}_{k}.xml'
            files[name].write_text(scene(lights, fog))
        runs = {name: [] for name in files}
        for run in range(options.runs + 1):  # the first builds kernels
            for name, file in files.items():
                runs[name].append(measure(file, run))
        cost = {}
        for name, results in runs.items():
            results = results[1:]
            seconds = min(r[0] for r in results)
            error = math.sqrt(sum(r[1]**2 for r in results) / len(results))
            cost[name] = seconds * error**2
            print(f'{room + ", " + name:24} {seconds:6.3f} s {100 * error:7.3f} % {results[0][2]:8.4f} '
                  f'{cost[name] / cost["one lamp"]:22.2f} x')
