#!/usr/bin/env python3
"""Writes docs/mitsuba-plugins.md: what becomes of each plugin of Mitsuba 3.9 here.

    tools/mitsuba_plugins.py           writes the page
    tools/mitsuba_plugins.py --check   exit code 1 where the page is not what the program does

For each plugin a small scene is written and given to `itn parameters`: what is refused is asked of the program, not
remembered, and so is which parameters a plugin has. Those of a plugin that works, but for the ones named below, must each have
a scene in mitsuba_scenes.py, whose image mitsuba_parameters.py compares with Mitsuba's; one without ends this with exit code 1.
In what way a plugin differs stands in the list below.
"""
import argparse
import os
import re
import struct
import subprocess
import sys
import tempfile
import zlib

POLARISATION = 'not planned: polarisation'
CURVES = 'not planned: splats'
SURFACES, MEDIA = 'planned, with the surfaces', 'planned, with media and lights'

# tag -> (what it is called, the scene around it with %s for the element)
AROUND = {
    'sensor': ('Sensors', '%s'),
    'film': ('Films', '<sensor type="perspective">%s</sensor>'),
    'rfilter': ('Reconstruction filters',
                '<sensor type="perspective"><film type="hdrfilm">%s</film></sensor>'),
    'sampler': ('Samplers', '<sensor type="perspective">%s</sensor>'),
    'integrator': ('Integrators', '%s'),
    'shape': ('Shapes', '%s'),
    'bsdf': ('Surfaces (bsdf)', '<shape type="sphere">%s</shape>'),
    'texture': ('Textures', '<bsdf type="diffuse">%s</bsdf>'),
    'spectrum': ('Spectra', '<emitter type="constant">%s</emitter>'),
    'medium': ('Media', '%s'),
    'phase': ('Phase functions', '<medium type="homogeneous">%s</medium>'),
    'volume': ('Volumes', '<medium type="heterogeneous">%s</medium>'),
    'emitter': ('Emitters', '%s'),
}
LIGHT = '<emitter type="constant"/>'

# Parameters without a scene: how Mitsuba divides its work and what it keeps in memory, and those that are this program's alone.
NOT_COMPARED = {'timeout', 'block_size', 'samples_per_pass', 'shutter_open', 'shutter_close', 'seed', 'sample_count', 'accel', 'format',
                'silhouette_sampling_weight', 'sigma_s', 'sigma_s_prime', 'sigma_a', 'bits'}
OURS = {('bsdf', 'principled'): {'alpha_u'}, ('shape', 'serialized'): {'flip_tex_coords'},
        ('texture', 'mesh_attribute'): {'name'}}  # the name alone says which: tests/scene


def rgb(name, value='0.5'):
    return f'<rgb name="{name}" value="{value}"/>'


def number(name, value):
    return f'<float name="{name}" value="{value}"/>'


def text(name, value):
    return f'<string name="{name}" value="{value}"/>'


ONE_PIXEL = ('<film type="hdrfilm"><integer name="width" value="1"/><integer name="height" value="1"/></film>')
NEGATIVE = 'rendered as gaussian (stddev 0.5), with a warning'
SOMETHING_ELSE = 'its nested integrator is rendered, or radiance, with a warning'
ONE_ALPHA = 'alpha is the same along both axes'
MEDIA_TOO = 'media count, which it ignores in Mitsuba'
DIFFUSE = '<bsdf type="diffuse"/>'
VALUES = text('wavelengths', '400, 700') + text('values', '1, 2')


def rows(tag, types, differs='', why=''):
    """Plugins that need no content, alike in how they differ and why they may be refused."""
    return [(tag, kind, '', differs, why) for kind in types.split()]


# (tag, type, what it contains, how it differs, why it may be refused[, name attribute])
PLUGINS = [
    ('sensor', 'perspective', '', '', ''),
    ('sensor', 'orthographic', '', '', ''),
    ('sensor', 'thinlens', number('aperture_radius', 1), '', ''),
    ('sensor', 'radiancemeter', ONE_PIXEL, '', ''),
    ('sensor', 'irradiancemeter', ONE_PIXEL, 'with more than one pixel, each measures the whole shape; lights without extent shine straight on it, in Mitsuba not at all', ''),
    ('sensor', 'distant', ONE_PIXEL, '', ''),
    ('sensor', 'batch', '<sensor type="perspective"/>', '', 'a scene may have several sensors; --sensor chooses'),
    ('film', 'hdrfilm', '', 'always written as float32 OpenEXR; no alpha, no XYZ (with a warning)', ''),
    ('film', 'specfilm', '', '', 'not planned: wavelengths beyond RGB'),
    *rows('rfilter', 'box tent gaussian'),
    *rows('rfilter', 'mitchell catmullrom lanczos', NEGATIVE),
    *rows('sampler', 'independent'),
    *rows('sampler', 'stratified multijitter orthogonal ldsampler', 'gives the number of samples, which are independent'),
    *rows('integrator', 'path', MEDIA_TOO),
    *rows('integrator', 'direct', 'max_depth 2; bsdf_samples 0 is 1; ' + MEDIA_TOO),
    *rows('integrator', 'direct_projective', 'max_depth 2; ' + MEDIA_TOO + '; no derivatives by visibility'),
    *rows('integrator', 'volpath volpathmis'),
    *rows('integrator', 'ptracer', 'paths start at the camera, so hide_emitters shows what is behind; ' + MEDIA_TOO),
    *rows('integrator', 'prb', MEDIA_TOO),
    *rows('integrator', 'prb_basic', 'connects lights, so that those without extent shine, which they do not in Mitsuba; ' + MEDIA_TOO),
    *rows('integrator', 'prb_projective', MEDIA_TOO + '; no derivatives by visibility'),
    *rows('integrator', 'prbvolpath', 'max_depth is volpath\'s; in Mitsuba paths end a vertex later, without its connection'),
    *rows('integrator', 'volprim_rf_basic', '', CURVES),
    ('integrator', 'aov', text('aovs', 'd:depth'), SOMETHING_ELSE, ''),
    *rows('integrator', 'depth', SOMETHING_ELSE),
    *rows('integrator', 'moment', SOMETHING_ELSE + '; every image has its standard error anyway'),
    *rows('integrator', 'stokes', SOMETHING_ELSE),
    ('shape', 'obj', text('filename', 't.obj'), '', ''),
    ('shape', 'ply', text('filename', 't.ply'), 'no attributes of vertices and faces', ''),
    ('shape', 'serialized', text('filename', 't.serialized'), '', ''),
    *rows('shape', 'sphere rectangle cube disk cylinder'),
    ('shape', 'shapegroup', '<shape type="sphere"/>', '', ''),
    ('shape', 'instance', '<shape type="shapegroup"><shape type="sphere"/></shape>', '', ''),
    ('shape', 'merge', '<shape type="sphere"/>', '', 'an optimisation of Mitsuba: list the shapes themselves'),
    ('shape', 'linearcurve', text('filename', 't.txt'), 'a fine mesh', ''),
    ('shape', 'bsplinecurve', text('filename', 't.txt'), 'a fine mesh, whose inside shows where its ends are open', ''),
    ('shape', 'sdfgrid', text('filename', 'd.vol'), 'a fine mesh', ''),
    *rows('shape', 'ellipsoids ellipsoidsmesh', '', CURVES),
    ('bsdf', 'diffuse', '', '', SURFACES),
    ('bsdf', 'dielectric', '', '', SURFACES),
    ('bsdf', 'thindielectric', '', 'what passes it does not count in max_depth, as in volpath; in path it does. Lights without extent do not shine through it, as in path; in volpath they do', SURFACES),
    ('bsdf', 'roughdielectric', '', '', SURFACES),
    ('bsdf', 'conductor', '', '', SURFACES),
    ('bsdf', 'roughconductor', '', '', SURFACES),
    ('bsdf', 'plastic', '', '', SURFACES),
    ('bsdf', 'roughplastic', '', 'int_ior must be above ext_ior', SURFACES),
    ('bsdf', 'pplastic', '', ONE_ALPHA, SURFACES),
    ('bsdf', 'principled', '', '', SURFACES),
    ('bsdf', 'principledthin', '', '', SURFACES),
    ('bsdf', 'blendbsdf', number('weight', 0.5) + DIFFUSE + '<bsdf type="dielectric"/>',
     'beside a mirror Mitsuba 3.9.1 is too dark: it weighs the mirror\'s direction by the densities of the other surface, '
     'too; with an opaque surface beside one that light passes it counts light twice', SURFACES),
    ('bsdf', 'mask', DIFFUSE, 'what passes it does not count in max_depth and light is connected through it, as in '
     'volpath; in path it counts, and point lights do not shine through it', SURFACES),
    ('bsdf', 'twosided', DIFFUSE, 'allow_transmission is false', SURFACES),
    ('bsdf', 'bumpmap', DIFFUSE + '<texture type="bitmap" name="t">' + text('filename', 't.ppm') + '</texture>',
     'heights are a bitmap; not on disks, nor inside of normalmap and bumpmap', SURFACES),
    ('bsdf', 'normalmap',
     DIFFUSE + '<texture type="bitmap" name="normalmap">' + text('filename', 't.ppm') + '</texture>', '', SURFACES),
    ('bsdf', 'null', '', 'what passes it does not count in max_depth, as in volpath; in path it does. Lights without extent do not shine through it, as in path; in volpath they do', SURFACES),
    ('bsdf', 'measured', text('filename', 't.bsdf'), '', 'no measured surfaces of this format yet'),
    ('bsdf', 'hair', '', '', 'not planned: fibres'),
    ('bsdf', 'polarizer', '', 'as in variants without polarisation: half of the light passes', ''),
] + [('bsdf', name, '', '', POLARISATION)
     for name in ('circular', 'retarder', 'measured_polarized')] + [
    ('texture', 'bitmap', text('filename', 't.ppm'), '', '', 'reflectance'),
    ('texture', 'checkerboard', '', 'its colours are colours, not textures', '', 'reflectance'),
    ('texture', 'mesh_attribute', text('name', 'vertex_color'), '', SURFACES, 'reflectance'),
    ('texture', 'volume', '<volume type="constvolume">' + number('value', 0.5) + '</volume>', 'of surfaces, not of lights', '', 'reflectance'),
    ('spectrum', 'uniform', number('value', 1), '', '', 'radiance'),
    ('spectrum', 'srgb', rgb('color'), '', '', 'radiance'),
    ('spectrum', 'd65', '', 'white, as in Mitsuba\'s rgb variants; around a texture it is refused', '', 'radiance'),
    ('spectrum', 'regular', text('values', '1, 2'), 'integrated to linear sRGB; Mitsuba\'s rgb variants refuse it', '',
     'radiance'),
    ('spectrum', 'irregular', VALUES, 'integrated to linear sRGB; Mitsuba\'s rgb variants refuse it', '', 'radiance'),
    ('spectrum', 'rawconstant', number('value', 1), '', '', 'radiance'),
    ('spectrum', 'blackbody', number('temperature', 5000),
     'integrated to linear sRGB; Mitsuba\'s rgb variants refuse it', '', 'radiance'),
    ('medium', 'homogeneous', '', '', MEDIA),
    ('medium', 'heterogeneous', '', '', MEDIA),
    ('phase', 'isotropic', '', '', MEDIA),
    ('phase', 'hg', '', '', MEDIA),
    ('phase', 'rayleigh', '', '', MEDIA),
    ('phase', 'blendphase', number('weight', 0.5) + '<phase type="isotropic"/><phase type="hg"/>', '', MEDIA),
    ('phase', 'tabphase', text('values', '1, 2, 3'), 'of at most 128 values', MEDIA),
    ('phase', 'sggx', '', '', 'no phase functions of microflakes yet'),
    ('volume', 'constvolume', number('value', 0.5), 'where a colour may stand; in space its cube bounds sigma_t alone, as in Mitsuba', MEDIA, 'albedo'),
    ('volume', 'gridvolume', text('filename', 't.vol'), 'of one channel or three, of media and their phase functions alone', MEDIA, 'albedo'),
    ('emitter', 'constant', '', 'one environment a scene', MEDIA),
    ('emitter', 'envmap', text('filename', 't.ppm'), 'one environment a scene', MEDIA),
    ('emitter', 'sunsky', '', 'one environment a scene', MEDIA),
    ('emitter', 'timed_sunsky', '', '', 'the sun does not move: use sunsky'),
    ('emitter', 'area', '', 'its front is that of the surface, not of interpolated normals', MEDIA),
    ('emitter', 'point', '', '', MEDIA),
    ('emitter', 'spot', '', '', MEDIA),
    ('emitter', 'directional', '', '', MEDIA),
    ('emitter', 'directionalarea', '', 'of a rectangle or a disk; all integrators see its light, in Mitsuba `ptracer` alone', MEDIA),
    ('emitter', 'projector', '', '', MEDIA),
]


def write_files(folder):
    """Small files of the formats that plugins read: a tetrahedron, a picture, a grid."""
    corners, faces = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]
    with open(os.path.join(folder, 't.txt'), 'w') as file:
        file.write('0 0 0 .1\n1 0 0 .1\n1 1 0 .1\n0 1 0 .1\n')
    with open(os.path.join(folder, 't.obj'), 'w') as file:
        file.writelines('v %g %g %g\n' % corner for corner in corners)
        file.writelines('f %d %d %d\n' % tuple(i + 1 for i in face) for face in faces)
    with open(os.path.join(folder, 't.ply'), 'w') as file:
        file.write('ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n'
                   'element face 4\nproperty list uchar int vertex_indices\nend_header\n')
        file.writelines('%g %g %g\n' % corner for corner in corners)
        file.writelines('3 %d %d %d\n' % face for face in faces)
    body = struct.pack('<I', 0x1000) + b't\0' + struct.pack('<QQ', 4, 4)
    body += b''.join(struct.pack('<3f', *corner) for corner in corners)
    body += b''.join(struct.pack('<3I', *face) for face in faces)
    with open(os.path.join(folder, 't.serialized'), 'wb') as file:
        file.write(struct.pack('<HH', 0x041C, 4) + zlib.compress(body) + struct.pack('<QI', 0, 1))
    with open(os.path.join(folder, 't.ppm'), 'wb') as file:
        file.write(b'P6\n2 2\n255\n' + bytes(range(100, 112)))
    for name, values in ('t.vol', [0.5] * 8), ('d.vol', [-0.5] * 4 + [0.5] * 4):
        write_grid(os.path.join(folder, name), values)


def write_grid(file, values):
    """2 x 2 x 2 voxels over the unit cube."""
    with open(file, 'wb') as grid:
        grid.write(b'VOL\x03' + struct.pack('<5i6f8f', 1, 2, 2, 2, 1, 0, 0, 0, 1, 1, 1, *values))


def parameters_of(itn, folder, tag, kind, content, name):
    """Those that the program takes: it lists them where it is given another one."""
    message = opens(itn, folder, tag, kind, content + number('no_such_parameter', 1), name)[1]
    found = re.search(r'unknown parameter "no_such_parameter"; need ([^;]*)', message)
    return set(re.findall('"([^"]+)"', found.group(1))) if found else set()


def opens(itn, folder, tag, kind, content, name):
    """Whether a scene with the plugin opens, and the message if not."""
    element = f'<{tag} type="{kind}"' + (f' name="{name}"' if name else '') + f'>{content}</{tag}>'
    if (tag, kind) in (('emitter', 'area'), ('emitter', 'directionalarea'), ('sensor', 'irradiancemeter')):
        element = f'<shape type="rectangle">{element}</shape>'
    body = AROUND[tag][1] % element
    if '<sensor' not in body:
        body += '<sensor type="perspective"/>'
    if tag not in ('emitter', 'spectrum'):
        body += LIGHT
    file = os.path.join(folder, 'scene.xml')
    with open(file, 'w') as scene:
        scene.write(f'<scene version="3.0.0">{body}</scene>')
    run = subprocess.run([itn, 'parameters', file, '--quiet'], capture_output=True, text=True)
    if run.returncode not in (0, 3):
        sys.exit(f'itn parameters {file}: exit code {run.returncode}\n{run.stderr}')
    return run.returncode == 0, run.stderr


def compared_parameters(tag, kind):
    import mitsuba_scenes  # which imports this
    begin = f'{tag}.{kind}.'
    return {name[len(begin):].split(' ')[0] for name in mitsuba_scenes.ROWS if name.startswith(begin)}


def page(itn):
    rows, counts, missing = {}, {'works': 0, 'differs': 0, 'refused': 0}, []
    with tempfile.TemporaryDirectory() as folder:
        write_files(folder)
        for tag, kind, content, differs, reason, *name in PLUGINS:
            verdict = 'refused' if not opens(itn, folder, tag, kind, content, *(name or ['']))[0] else \
                'differs' if differs else 'works'
            compared = compared_parameters(tag, kind) if verdict != 'refused' else set()
            if verdict == 'works':
                taken = parameters_of(itn, folder, tag, kind, content, *(name or ['']))
                missing += [f'{tag} {kind}: {parameter}' for parameter in
                            sorted(taken - compared - NOT_COMPARED - OURS.get((tag, kind), set()))]
            counts[verdict] += 1
            remark = reason if verdict == 'refused' else differs
            names = ', '.join(f'`{parameter}`' for parameter in sorted(compared))
            rows.setdefault(tag, []).append(f'| `{kind}` | {verdict} | {remark} | {names} |')
    if missing:
        sys.exit('parameters that no scene of tools/mitsuba_scenes.py compares with Mitsuba: ' + '; '.join(missing))
    text = (f'# Plugins of Mitsuba 3.9\n\nOf {sum(counts.values())} plugins {counts["works"]} work, {counts["differs"]} '
            f'work and differ in what the table says, and {counts["refused"]} are refused:\na scene that uses these ends '
            'in an error that names all of them. "Works" means that the scene opens and renders what\nMitsuba\'s rgb '
            'variants render, with Mitsuba\'s parameter names and defaults. What is compared has a scene in which two values of the\nparameter give the images that '
             'Mitsuba gives, and the same where it does (`tools/mitsuba_parameters.py`).\n\n`tools/mitsuba_plugins.py` writes this '
             'page; `tools/lab/open_scenes.py FOLDER` says which scenes of a folder open, and what the\nothers lack.\n')
    for tag, (title, _) in AROUND.items():
        text += f'\n## {title}\n\n| plugin | here | remark | compared |\n|---|---|---|---|\n' + '\n'.join(rows[tag]) + '\n'
    return text


def main():
    here = os.path.dirname(os.path.abspath(__file__))
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--itn', default=os.path.join(here, '..', 'build', 'bin', 'itn'))
    parser.add_argument('--check', action='store_true', help='write nothing; compare')
    options = parser.parse_args()
    file, text = os.path.join(here, '..', 'docs', 'mitsuba-plugins.md'), page(options.itn)
    if options.check:
        with open(file) as present:
            if present.read() != text:
                sys.exit('docs/mitsuba-plugins.md is not what the program does; run tools/mitsuba_plugins.py')
        return
    os.makedirs(os.path.dirname(file), exist_ok=True)
    with open(file, 'w') as target:
        target.write(text)


if __name__ == '__main__':
    main()
