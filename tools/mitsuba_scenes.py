"""Small scenes that show what a parameter of a Mitsuba plugin does: ROWS, by 'tag.plugin.parameter', for mitsuba_parameters.py.

Each is a scene with two values of the parameter. The image's mean is what is compared, so no scene is alike on both sides of
its middle: what only moves the picture changes its mean, too.
"""
import dataclasses
import os
import struct
import zlib

import mitsuba_plugins


@dataclasses.dataclass
class Row:
    scenes: tuple         # with one value and with the other
    moves: bool = True    # does the image change? False: how Mitsuba samples, or what it ignores
    quick: bool = False   # in the test suite, too
    spp: int = 1024
    variant: str = 'scalar_rgb'


ROWS = {}


def number(name, value):
    return f'<float name="{name}" value="{value}"/>'


def integer(name, value):
    return f'<integer name="{name}" value="{value}"/>'


def flag(name, value):
    return f'<boolean name="{name}" value="{value}"/>'


def text(name, value):
    return f'<string name="{name}" value="{value}"/>'


def rgb(name, value):
    return f'<rgb name="{name}" value="{value}"/>'


def vector(name, value):
    return f'<vector name="{name}" value="{value}"/>'


def point(name, value):
    return f'<point name="{name}" value="{value}"/>'


def transform(content, name='to_world'):
    return f'<transform name="{name}">{content}</transform>'


def look(origin, target='0,0,0', up='0,0,1'):
    return transform(f'<lookat origin="{origin}" target="{target}" up="{up}"/>')


def film(content='', width=16, height=12, rfilter='box'):
    inside = rfilter if rfilter.startswith('<') else f'<rfilter type="{rfilter}"/>'
    return (f'<film type="hdrfilm">{integer("width", width)}{integer("height", height)}{content}'
            f'{"" if "pixel_format" in content else text("pixel_format", "rgb")}{inside}</film>')


def sensor(content='', kind='perspective', picture=None, place=None):
    place = look('0.4,-4,0.5') if place is None else place
    fov = '' if kind not in ('perspective', 'thinlens') or 'fov"' in content or 'focal' in content else number('fov', 40)
    return (f'<sensor type="{kind}">{fov}{content}{place}{film() if picture is None else picture}'
            '<sampler type="independent"/></sensor>')


def integrator(content='', kind='path', depth=4):
    limit = integer('max_depth', depth) if 'max_depth' not in content and kind not in ('direct',) else ''
    return f'<integrator type="{kind}">{limit}{content}</integrator>'


def bsdf(kind, content=''):
    return f'<bsdf type="{kind}">{content}</bsdf>'


def diffuse(value):
    return bsdf('diffuse', rgb('reflectance', value))


def ball(content, center='0,0,0', radius=1):
    return f'<shape type="sphere">{point("center", center)}{number("radius", radius)}{content}</shape>'


def wall(content, turn='<scale value="3"/><translate value="0,0,-1"/>'):
    return f'<shape type="rectangle">{transform(turn)}{content}</shape>'


def lamp(radiance='4', center='-1.5,-1,2', radius=0.4, content=''):
    return ball(f'<emitter type="area">{rgb("radiance", radiance)}{content}</emitter>', center, radius)


SKY = f'<emitter type="constant">{rgb("radiance", "0.2, 0.3, 0.4")}</emitter>'
SUN = f'<emitter type="directional">{vector("direction", "0.5,0.7,-1")}{rgb("irradiance", "1")}</emitter>'
FLOOR = wall(diffuse('0.3'))
BEHIND = wall(diffuse('0.8, 0.6, 0.4'), '<scale value="3"/><rotate x="1" angle="90"/><translate value="1.5,2,0"/>')
MIDDLE = ball(diffuse('0.7, 0.5, 0.3'), '-0.4,0,0', 0.8)
STAGE = MIDDLE + FLOOR + BEHIND
LIGHT = SKY + SUN


def scene(camera=None, how=None, things=STAGE, light=LIGHT):
    return (f'<scene version="3.0.0">{integrator() if how is None else how}{sensor() if camera is None else camera}{things}'
            f'{light}</scene>')


def show(name, build, values, **options):
    """build: from a value to a scene."""
    ROWS[name] = Row(tuple(build(value) for value in values), **options)


# ---- Sensors

def of_camera(parameter, values, kind='perspective', rest='', element=number, **options):
    show(f'sensor.{kind}.{parameter}',
         lambda v: scene(sensor(rest + ('' if v is None else element(parameter, v)), kind)), values, **options)


of_camera('fov', (40, 55), quick=True)
of_camera('fov_axis', ('x', 'y'), rest=number('fov', 40), element=text, quick=True)
of_camera('focal_length', ('50mm', '35mm'), element=text)
of_camera('near_clip', (0.01, 3.4), quick=True)
of_camera('far_clip', (100, 4.6), quick=True)
of_camera('principal_point_offset_x', (0, 0.2), quick=True)
of_camera('principal_point_offset_y', (0, 0.2), quick=True)
of_camera('shutter_open', (0, 0.5), rest=number('shutter_close', 1), moves=False)
show('sensor.perspective.to_world', lambda v: scene(sensor(place=look(v))), ('0.4,-4,0.5', '1,-5,1'), quick=True)
LENS = number('aperture_radius', 0.2)
of_camera('fov', (40, 55), 'thinlens', LENS + number('focus_distance', 4))
of_camera('aperture_radius', (0.01, 0.4), 'thinlens', number('focus_distance', 1.5))
of_camera('focus_distance', (4, 0.8), 'thinlens', number('aperture_radius', 0.6))
of_camera('near_clip', (0.01, 3.4), 'thinlens', LENS + number('focus_distance', 4))
of_camera('far_clip', (100, 4.6), 'thinlens', LENS + number('focus_distance', 4))
of_camera('near_clip', (0.01, 3.4), 'orthographic')
of_camera('far_clip', (100, 4.6), 'orthographic')
show('sensor.orthographic.to_world', lambda v: scene(sensor(place=transform(
    f'<scale x="{v}" y="{v}"/><lookat origin="0.4,-4,0.5" target="0,0,0" up="0,0,1"/>'), kind='orthographic')), (1, 2))
of_camera('fov_axis', ('x', 'y'), 'thinlens', LENS + number('fov', 40) + number('focus_distance', 4), text)
of_camera('focal_length', ('50mm', '35mm'), 'thinlens', LENS + number('focus_distance', 4), text)
show('sensor.thinlens.to_world', lambda v: scene(sensor(LENS + number('focus_distance', 4), 'thinlens', place=look(v))),
     ('0.4,-4,0.5', '1,-5,1'))
for kind in 'perspective', 'orthographic':
    of_camera('focus_distance', (1, 4), kind, moves=False)
POINT = film('', 1, 1)
show('sensor.radiancemeter.origin', lambda v: scene(sensor(
    point('origin', v) + vector('direction', '0,1,0'), 'radiancemeter', POINT, '')), ('0,-4,0.2', '0.7,-4,1'), spp=65536)
show('sensor.radiancemeter.direction', lambda v: scene(sensor(
    point('origin', '0,-4,0.2') + vector('direction', v), 'radiancemeter', POINT, '')), ('0,1,0', '0.2,1,0.2'), spp=65536)
show('sensor.radiancemeter.to_world', lambda v: scene(sensor(
    '', 'radiancemeter', POINT, look(v))), ('0,-4,0.2', '0.7,-4,1'), spp=65536)
show('sensor.distant.direction', lambda v: scene(sensor(vector('direction', v), 'distant', POINT, '')),
     ('0,1,-0.5', '0.3,0,-1'), spp=65536)
show('sensor.distant.target', lambda v: scene(sensor(
    vector('direction', '0,1,-0.5') + point('target', v), 'distant', POINT, '')), ('0,0,0', '0.5,0,-1'), spp=65536)
show('sensor.distant.target shape', lambda v: scene(sensor(
    vector('direction', '0,1,-0.5') + f'<shape type="rectangle" name="target">{transform(v)}</shape>', 'distant', POINT, '')),
    ('<scale value="0.5"/>', '<scale value="2"/>'), spp=65536)
show('sensor.distant.to_world', lambda v: scene(sensor('', 'distant', POINT, look(v))), ('0,-4,2', '1,0,4'), spp=65536)
show('sensor.irradiancemeter.to_world', lambda v: scene('', light=SKY, things=STAGE + wall(
    diffuse('0.5') + sensor('', 'irradiancemeter', POINT, ''), v)),
    ('<scale value="0.1"/><translate value="1,0,0"/>', '<scale value="0.1"/><rotate x="1" angle="90"/><translate value="1,0,0"/>'),
    spp=65536)
FOG = ('<medium type="homogeneous" id="fog">' + number('sigma_t', '%s') + rgb('albedo', '0.8') + '</medium>')
ROOM = '<shape type="cube">' + transform('<scale value="9"/>') + bsdf('null') + '<ref name="interior" id="fog"/></shape>'
BALL_IN_FOG = ball(diffuse('0.7, 0.5, 0.3') + '<ref name="exterior" id="fog"/>', '-0.4,0,0', 0.8)


def foggy(camera, sigma=0.2):
    return scene(FOG % sigma + camera, integrator(kind='volpath'), ROOM + BALL_IN_FOG, SKY + SUN)


show('sensor.perspective.medium', lambda v: foggy(sensor(v)), ('<ref id="fog"/>', '<ref id="fog"/>' + number('near_clip', 6)))
show('sensor.perspective.far_clip in a medium', lambda v: foggy(sensor('<ref id="fog"/>' + number('far_clip', v))), (100, 2.5))
show('sensor.perspective.far_clip behind a boundary', lambda v: scene(
    sensor(number('far_clip', v)), integrator(kind='volpath'), ball(bsdf('null'), '0.4,-3.5,0.5', 0.2) + STAGE), (100, 4.6))

# ---- Films and filters


def of_film(parameter, values, element, rest='', filters='box', **options):
    show(f'film.hdrfilm.{parameter}', lambda v: scene(sensor(picture=film(
        rest + ('' if v is None else element(parameter, v)), rfilter=filters))), values, **options)


CROP = integer('crop_width', 8) + integer('crop_height', 6)
of_film('crop_offset_x', (0, 7), integer, CROP, quick=True)
of_film('crop_offset_y', (0, 5), integer, CROP, quick=True)
of_film('crop_width', (16, 7), integer, quick=True)
of_film('crop_height', (12, 5), integer, quick=True)
of_film('pixel_format', ('rgb', 'luminance'), text, spp=4096)
of_film('component_format', ('float32', 'float16'), text, moves=False)
of_film('file_format', ('openexr', 'pfm'), text, moves=False)
WIDE = f'<rfilter type="gaussian">{number("stddev", 1.5)}</rfilter>'
of_film('sample_border', ('true', 'false'), flag, filters=WIDE, quick=True, spp=4096)
show('film.hdrfilm.sample_border of a crop', lambda v: scene(sensor(picture=film(
    integer('crop_offset_x', 5) + integer('crop_offset_y', 3) + CROP + flag('sample_border', v), rfilter=WIDE))),
    ('true', 'false'), quick=True, spp=16384)
show('film.hdrfilm.sample_border of a tent', lambda v: scene(sensor(picture=film(
    flag('sample_border', v), rfilter=f'<rfilter type="tent">{number("radius", 3)}</rfilter>'))), ('true', 'false'), quick=True, spp=4096)
of_film('compensate', ('false', 'true'), flag, moves=False)
show('film.hdrfilm.width', lambda v: scene(sensor(picture=film('', v, 12))), (16, 24), quick=True)
show('film.hdrfilm.height', lambda v: scene(sensor(picture=film('', 16, v))), (12, 20), quick=True)
for kind, parameter, values in ('gaussian', 'stddev', (0.5, 2)), ('tent', 'radius', (1, 4)):
    show(f'rfilter.{kind}.{parameter}', lambda v, kind=kind, parameter=parameter: scene(sensor(picture=film(
        '', rfilter=f'<rfilter type="{kind}">{number(parameter, v)}</rfilter>'))), values, quick=True, spp=4096)

# ---- Integrators

VISIBLE = STAGE + lamp('2', '0.6,-1,0.7', 0.3)
for kind in 'path', 'volpath', 'volpathmis', 'prb', 'prbvolpath', 'prb_basic', 'direct', 'ptracer':
    more = dict(variant='llvm_ad_rgb') if kind.startswith('prb') else {}
    quick = kind in ('path', 'volpath')
    light = SKY if kind == 'prb_basic' else LIGHT  # Mitsuba's prb_basic connects no light: what has no extent is not seen
    if kind != 'direct':
        # Mitsuba's prbvolpath ends one vertex later, without its connection (tools/mitsuba_plugins.py).
        for depth in {'ptracer': (1,), 'prbvolpath': ()}.get(kind, (0, 1, 2)):
            show(f'integrator.{kind}.max_depth {depth}', lambda v, kind=kind, light=light: scene(
                how=integrator(integer('max_depth', v), kind), things=VISIBLE, light=light), (depth, depth + 1), quick=quick,
                 moves=depth > 0 or kind not in ('prb', 'prb_basic'), **more)
        show(f'integrator.{kind}.rr_depth', lambda v, kind=kind, light=light: scene(how=integrator(
            integer('rr_depth', v), kind), things=VISIBLE, light=light), (100, 1), moves=False, quick=quick, **more)
    if kind != 'ptracer':  # from its lights Mitsuba's cannot see what a hidden lamp hides
        show(f'integrator.{kind}.hide_emitters', lambda v, kind=kind, light=light: scene(how=integrator(
            flag('hide_emitters', v), kind), things=VISIBLE, light=light), ('false', 'true'), quick=quick, **more)
show('integrator.volpath.hide_emitters behind a boundary', lambda v: scene(how=integrator(
    flag('hide_emitters', v), 'volpath'), things=VISIBLE + ball(bsdf('null'), '0.6,-1,0.7', 0.35)), ('false', 'true'), quick=True)
show('integrator.volpath.hide_emitters of glass', lambda v: scene(how=integrator(
    flag('hide_emitters', v), 'volpath'), things=STAGE + ball(
        bsdf('dielectric') + f'<emitter type="area">{rgb("radiance", 1)}</emitter>', '0.6,-1,0.7', 0.3)), ('false', 'true'))
for parameter, values in ('emitter_samples', (1, 4)), ('bsdf_samples', (1, 4)):
    show(f'integrator.direct.{parameter}', lambda v, parameter=parameter: scene(how=integrator(
        integer(parameter, v), 'direct'), light=SKY), values, moves=False)  # SUN: a fault of 3.9.1 (scenes/README.md)
show('integrator.direct.emitter_samples 0', lambda v: scene(how=integrator(
    integer('emitter_samples', v) + integer('bsdf_samples', 1), 'direct')), (1, 0))
show('integrator.volpathmis.use_spectral_mis', lambda v: scene(how=integrator(
    flag('use_spectral_mis', v), 'volpathmis')), ('true', 'false'), moves=False)

# ---- Shapes

PICTURE = '<texture type="bitmap" name="{}">' + text('filename', '{}') + '{}</texture>'


def of_shape(kind, parameter, content, values, **options):
    show(f'shape.{kind}.{parameter}', lambda v: scene(things=f'<shape type="{kind}">{content(v)}{diffuse("0.7, 0.5, 0.3")}</shape>' +
                                                      FLOOR + BEHIND), values, **options)


MOVED = '<scale x="0.8" y="0.5" z="1.2"/><rotate z="1" angle="{0}"/><translate x="{0}"/>'
for kind, rest in ('sphere', ''), ('rectangle', ''), ('cube', ''), ('disk', ''), ('cylinder', ''), \
        ('obj', text('filename', 't.obj')), ('ply', text('filename', 't.ply')), ('serialized', text('filename', 't.serialized')):
    turn = '<scale value="{1}"/><rotate x="1" angle="80"/><translate x="{0}"/>' if kind in ('sphere', 'cylinder', 'rectangle', 'disk') \
        else '<scale x="0.8" y="0.5" z="{1}"/><rotate z="1" angle="30"/><translate x="{0}"/>'
    of_shape(kind, 'to_world', lambda v, rest=rest, turn=turn: rest + transform(turn.format(*v)), ((-0.3, 0.6), (0.3, 1.1)))
    of_shape(kind, 'flip_normals', lambda v, rest=rest, turn=turn: rest + transform(turn.format(0, 0.9)) +
             flag('flip_normals', v), ('false', 'true'))
of_shape('sphere', 'center', lambda v: point('center', v), ('-0.4,0,0', '0.7,0,0.3'))
of_shape('sphere', 'radius', lambda v: number('radius', v), (0.5, 0.9))
of_shape('cylinder', 'p0', lambda v: point('p0', v) + point('p1', '0,0,1') + number('radius', 0.4), ('0,0,0', '0.5,-1,-0.5'))
of_shape('cylinder', 'p1', lambda v: point('p0', '0,0,-1') + point('p1', v) + number('radius', 0.4), ('0,0,0', '0.5,-1,0.5'))
of_shape('cylinder', 'radius', lambda v: point('p0', '0,0,-1') + point('p1', '0,0,1') + number('radius', v), (0.3, 0.6))
for kind in 'obj', 'ply', 'serialized':
    of_shape(kind, 'face_normals', lambda v, kind=kind: text('filename', 'round.' + kind) + flag('face_normals', v),
             ('false', 'true'))
    of_shape(kind, 'filename', lambda v, kind=kind: text('filename', v + kind), ('round.', 't.'))
    if kind != 'serialized':
        show(f'shape.{kind}.flip_tex_coords', lambda v, kind=kind: scene(things=(
            f'<shape type="{kind}">{text("filename", "uv." + kind)}{flag("flip_tex_coords", v)}' +
            bsdf('diffuse', PICTURE.format('reflectance', 'big.ppm', '')) + '</shape>') + FLOOR), ('false', 'true'))
of_shape('serialized', 'shape_index', lambda v: text('filename', 'two.serialized') + integer('shape_index', v), (0, 1))
for kind in 'rectangle', 'cube':
    of_shape(kind, 'face_normals', lambda v: transform('<scale value="0.7"/><rotate x="1" angle="80"/>') + flag('face_normals', v),
             ('false', 'true'), moves=False)
show('shape.instance.to_world', lambda v: scene(things=f'<shape type="shapegroup" id="group">{MIDDLE}</shape>' + FLOOR + BEHIND +
     f'<shape type="instance"><ref id="group"/>{transform(v)}</shape>'), ('<translate x="-0.4"/>', '<translate x="0.8"/>'))

# ---- Surfaces


def of_bsdf(kind, parameter, values, element=number, rest='', inside='', light=None, **options):
    # Mitsuba's volpath connects lights without extent through thin glass (tools/mitsuba_plugins.py).
    lights = (SKY if kind == 'thindielectric' else LIGHT) + lamp() if light is None else light
    show(f'bsdf.{kind}.{parameter}', lambda v: scene(
        CLOSE, how=integrator(kind='volpath', depth=8),
        things=ball(bsdf(kind, rest + ('' if v is None else element(parameter, v)) + inside), '-0.4,0,0', 0.8) + FLOOR + BEHIND,
        light=lights), values, **options)


CLOSE = sensor(number('fov', 20), place=look('-0.7,-4,0.7', '-0.4,0,0'))
COLOURS = ('0.7, 0.5, 0.3', '0.2, 0.4, 0.9')
of_bsdf('diffuse', 'reflectance', COLOURS, rgb)
INDICES = (('int_ior', (1.5, 1.2)), ('ext_ior', (1.0, 1.2)))
for kind in 'dielectric', 'roughdielectric', 'thindielectric', 'plastic', 'roughplastic', 'pplastic':
    for parameter, values in INDICES:
        of_bsdf(kind, parameter, values)
    of_bsdf(kind, 'specular_reflectance', COLOURS, rgb)
    if 'dielectric' in kind:
        of_bsdf(kind, 'specular_transmittance', COLOURS, rgb)
    else:
        of_bsdf(kind, 'diffuse_reflectance', COLOURS, rgb)
of_bsdf('dielectric', 'int_ior by name', ('water', 'diamond'), lambda _, v: text('int_ior', v))
for kind in 'plastic', 'roughplastic':
    of_bsdf(kind, 'nonlinear', ('false', 'true'), flag, rgb('diffuse_reflectance', '0.8, 0.6, 0.3'))
ROUGH = number('alpha', 0.3)
for kind in 'roughdielectric', 'roughplastic', 'pplastic', 'roughconductor':
    of_bsdf(kind, 'alpha', (0.1, 0.5))
    of_bsdf(kind, 'distribution', ('beckmann', 'ggx'), text, number('alpha', 0.5))
    of_bsdf(kind, 'sample_visible', ('true', 'false'), flag, ROUGH, moves=False)
for kind in 'roughdielectric', 'roughconductor':
    of_bsdf(kind, 'alpha_u', (0.1, 0.6), rest=number('alpha_v', 0.3))
    of_bsdf(kind, 'alpha_v', (0.1, 0.6), rest=number('alpha_u', 0.3))
for kind in 'conductor', 'roughconductor':
    of_bsdf(kind, 'material', ('Au', 'none'), text)
    of_bsdf(kind, 'eta', ('0.2, 0.9, 1.5', '2, 2, 1'), rgb, rgb('k', '3, 2, 2'))
    of_bsdf(kind, 'k', ('0.5, 1, 1.5', '3, 2, 4'), rgb, rgb('eta', '1, 0.8, 0.6'))
    of_bsdf(kind, 'specular_reflectance', COLOURS, rgb)
of_bsdf('principled', 'base_color', COLOURS, rgb)
for parameter, values, rest in (
        ('roughness', (0.2, 0.7), ''), ('anisotropic', (0, 0.9), number('metallic', 1)), ('metallic', (0, 0.8), ''),
        ('spec_trans', (0, 0.8), ''), ('eta', (1.3, 2), number('spec_trans', 0.5)), ('specular', (0.1, 0.9), ''),
        ('spec_tint', (0, 1), ''), ('sheen', (0, 1), ''), ('sheen_tint', (0, 1), number('sheen', 1)), ('flatness', (0, 1), ''), ('clearcoat', (0, 1), '')):
    of_bsdf('principled', parameter, values, rest=rgb('base_color', '0.7, 0.4, 0.2') + rest)
of_bsdf('principled', 'clearcoat_gloss', (0, 1), rest=rgb('base_color', '0.02') + number('clearcoat', 1) + number('roughness', 0.9),
        light=lamp('40'))
for parameter in 'main_specular_sampling_rate', 'clearcoat_sampling_rate', 'diffuse_reflectance_sampling_rate':
    of_bsdf('principled', parameter, (1, 2), rest=number('clearcoat', 0.5), moves=False)
of_bsdf('principledthin', 'base_color', COLOURS, rgb)
for parameter, values, rest in (
        ('roughness', (0.2, 0.7), number('spec_trans', 0.5)), ('anisotropic', (0, 0.9), number('spec_trans', 1)),
        ('spec_trans', (0, 0.8), ''), ('eta', (1.3, 2), number('spec_trans', 0.5)),
        ('spec_tint', (0, 1), number('spec_trans', 1)), ('sheen', (0, 1), ''), ('sheen_tint', (0, 1), number('sheen', 1)),
        ('flatness', (0, 1), ''), ('diff_trans', (0, 1.2), '')):
    of_bsdf('principledthin', parameter, values, rest=rgb('base_color', '0.7, 0.4, 0.2') + rest)
for part in 'specular_reflectance', 'specular_transmittance', 'diffuse_reflectance', 'diffuse_transmittance':
    of_bsdf('principledthin', part + '_sampling_rate', (1, 2), rest=number('spec_trans', 0.5), moves=False)
of_bsdf('blendbsdf', 'weight', (0.2, 0.8), inside=diffuse('0.1') + diffuse('0.9'))
of_bsdf('mask', 'opacity', (0.2, 0.8), inside=diffuse('0.7'))
show('bsdf.twosided.bsdf', lambda v: scene(things=ball(
    bsdf('twosided', diffuse(v)) + flag('flip_normals', 'true'), '-0.4,0,0', 0.8) + FLOOR), ('0.2', '0.8'))
show('bsdf.twosided.second bsdf', lambda v: scene(things=ball(
    bsdf('twosided', diffuse('0.5') + diffuse(v)) + flag('flip_normals', 'true'), '-0.4,0,0', 0.8) + FLOOR), ('0.2', '0.8'))
of_bsdf('normalmap', 'normalmap', ('n.ppm', 'm.ppm'), lambda name, v: PICTURE.format(name, v, flag('raw', 'true')),
        inside=diffuse('0.7'))
for parameter in 'flip_invalid_normals', 'use_shadowing_function':
    of_bsdf('normalmap', parameter, ('true', 'false'), flag, PICTURE.format('normalmap', 'm.ppm', flag('raw', 'true')),
            diffuse('0.7'))
BUMPS = PICTURE.format('nested', 'big.ppm', flag('raw', 'true'))
of_bsdf('bumpmap', 'scale', (0, 0.4), rest=BUMPS, inside=diffuse('0.7'))
for parameter in 'flip_invalid_normals', 'use_shadowing_function':
    of_bsdf('bumpmap', parameter, ('true', 'false'), flag, BUMPS + number('scale', 3), diffuse('0.7'),
            moves=parameter != 'flip_invalid_normals')
of_bsdf('polarizer', 'transmittance', ('0.2', '0.8'), rgb)
of_bsdf('polarizer', 'theta', (0, 30), moves=False)
show('bsdf.null.medium', lambda v: scene(how=integrator(kind='volpath', depth=20), things=ball(
    bsdf('null') + '<medium name="interior" type="homogeneous">' + number('sigma_t', v) + '</medium>') + FLOOR), (0.2, 2))

# ---- Textures and spectra


def of_texture(kind, parameter, values, element, rest='', **options):
    show(f'texture.{kind}.{parameter}', lambda v: scene(things=wall(
        bsdf('diffuse', f'<texture type="{kind}" name="reflectance">{rest}{"" if v is None else element(parameter, v)}</texture>'),
        '<scale value="1.1"/><rotate x="1" angle="80"/>') + FLOOR), values, **options)


of_texture('bitmap', 'filename', ('t.ppm', 'big.ppm'), text)
BIG = text('filename', 'big.ppm')
of_texture('bitmap', 'raw', ('false', 'true'), flag, BIG)
of_texture('bitmap', 'filter_type', ('bilinear', 'nearest'), text, text('filename', 't.ppm') +
           transform('<scale x="0.7" y="0.6"/>', 'to_uv'))
for wrap in 'mirror', 'clamp':
    of_texture('bitmap', f'wrap_mode {wrap}', ('repeat', wrap), lambda _, v: text('wrap_mode', v),
               BIG + transform('<scale x="1.7" y="2.6"/><translate x="0.2"/>', 'to_uv'))
of_texture('bitmap', 'to_uv', ('<scale x="1" y="1"/>', '<scale x="0.3" y="0.4"/><translate x="0.2" y="0.1"/>'),
           lambda name, v: transform(v, name), BIG)
for parameter, values in (('scale', (1, 0.5)),):
    show(f'texture.mesh_attribute.{parameter}', lambda v, parameter=parameter: scene(things=(
        f'<shape type="ply">{text("filename", "uv.ply")}' + bsdf('diffuse', '<texture type="mesh_attribute" name="reflectance">' + (
            text('name', 'vertex_color') + number(parameter, v)) + '</texture>') +
        '</shape>') + FLOOR), values)
of_texture('checkerboard', 'color0', COLOURS, rgb)
of_texture('checkerboard', 'color1', COLOURS, rgb)
of_texture('checkerboard', 'to_uv', ('<scale x="1" y="1"/>', '<scale x="0.4" y="0.3"/><translate x="0.2" y="0.1"/>'),
           lambda name, v: transform(v, name), rgb('color0', '0.1') + rgb('color1', '0.9'))


def of_spectrum(kind, parameter, values, element, **options):
    show(f'spectrum.{kind}.{parameter}', lambda v: scene(
        light=f'<emitter type="constant"><spectrum type="{kind}" name="radiance">{element(parameter, v)}</spectrum></emitter>'),
        values, **options)


of_spectrum('uniform', 'value', (0.5, 1.5), number)
of_spectrum('srgb', 'color', COLOURS, rgb)
for parameter, value in ('wavelength_min', 400), ('wavelength_max', 700):
    of_spectrum('uniform', parameter, (value, value + 1), lambda name, v: number('value', 0.7) + number(name, v), moves=False)
of_spectrum('srgb', 'unbounded', ('false', 'true'), lambda name, v: rgb('color', '0.5, 0.6, 0.7') + flag(name, v), moves=False)
of_spectrum('rawconstant', 'value', (0.5, 1.5), number)
of_spectrum('d65', 'scale', (0.5, 1.5), number)

# ---- Media


def medium(content, kind='homogeneous', phase=''):
    return f'<medium name="interior" type="{kind}">{content}{phase}</medium>'


def in_medium(content, light=LIGHT, boundary='null', depth=30, integrate='volpath'):
    return scene(CLOSE, how=integrator(kind=integrate, depth=depth), things=ball(bsdf(boundary) + content, '-0.4,0,0', 0.8) + FLOOR,
                 light=light)


def of_medium(parameter, values, element, rest='', name=None, kind='homogeneous', **options):
    show(f'medium.{kind}.{name or parameter}', lambda v: in_medium(medium(rest + element(parameter, v), kind)), values, **options)


of_medium('sigma_t', (0.5, 3), number)
of_medium('sigma_t', ('0.2, 0.5, 0.9', '0.9, 0.5, 0.2'), rgb, number('scale', 3), name='sigma_t rgb')
of_medium('albedo', ('0.3, 0.6, 0.9', '0.9, 0.6, 0.3'), rgb, number('sigma_t', 2))
of_medium('scale', (1, 3), number, number('sigma_t', 0.7))
of_medium('has_spectral_extinction', ('true', 'false'), flag, number('sigma_t', 2), moves=False)
LAMPS = {'point': f'<emitter type="point">{point("position", "-1,-2,2")}{rgb("intensity", 5)}%s</emitter>',
         'spot': f'<emitter type="spot">{look("-1,-2,2.5")}{rgb("intensity", 9)}%s</emitter>',
         'directional': f'<emitter type="directional">{vector("direction", "0.5,0.7,-1")}%s</emitter>',
         'projector': f'<emitter type="projector">{look("-1,-2,2.5")}{number("fov", 40)}{rgb("irradiance", 1)}%s</emitter>',
         'area': ball('<emitter type="area">' + rgb('radiance', 5) + '%s</emitter>', '-1,-2,2', 0.5),
         'constant': '<emitter type="constant">%s</emitter>',
         'envmap': f'<emitter type="envmap">{text("filename", "big.ppm")}%s</emitter>'}
for kind, light in LAMPS.items():
    quick = kind in ('point', 'directional')
    other = SKY if kind not in ('constant', 'envmap') else SUN
    show(f'medium.homogeneous.sample_emitters {kind}', lambda v, light=light, kind=kind: in_medium(
        medium(number('sigma_t', 2) + flag('sample_emitters', v)), light % '' + (SKY if kind not in ('constant', 'envmap') else '')),
        ('true', 'false'), moves=kind not in ('area', 'constant', 'envmap'), quick=quick)
    show(f'medium.homogeneous.sample_emitters {kind}, rough', lambda v, light=light, kind=kind: in_medium(
        medium(number('sigma_t', 2) + flag('sample_emitters', v)), light % '' + (SKY if kind not in ('constant', 'envmap') else ''),
        'roughdielectric'), ('true', 'false'), moves=False, spp=4096)
    show(f'emitter.{kind}.sampling_weight 0', lambda v, light=light, other=other: scene(
        light=light % number('sampling_weight', v) + other), (1, 0), moves=kind not in ('area', 'constant', 'envmap'), quick=quick)
    show(f'emitter.{kind}.sampling_weight', lambda v, light=light, other=other: scene(
        light=light % number('sampling_weight', v) + other), (1, 4), moves=False)
show('medium.homogeneous.sample_emitters volpathmis', lambda v: in_medium(
    medium(number('sigma_t', 2) + flag('sample_emitters', v)), LAMPS['point'] % '' + SKY, integrate='volpathmis'),
    ('true', 'false'))
GRID = '<volume type="gridvolume" name="{}">' + text('filename', '{}') + '{}</volume>'
PLACE = transform('<translate value="-0.5,-0.5,-0.5"/><scale value="2"/>')
of_medium('sigma_t', ('a.vol', 'b.vol'), lambda name, v: GRID.format(name, v, PLACE), kind='heterogeneous')
of_medium('albedo', ('a.vol', 'b.vol'), lambda name, v: GRID.format(name, v, PLACE), GRID.format('sigma_t', 'b.vol', PLACE) +
          number('scale', 3), kind='heterogeneous')
of_medium('has_spectral_extinction', ('true', 'false'), flag, GRID.format('sigma_t', 'b.vol', PLACE), kind='heterogeneous',
          moves=False)
of_medium('scale', (1, 4), number, GRID.format('sigma_t', 'b.vol', PLACE), kind='heterogeneous')
show('medium.heterogeneous.sample_emitters', lambda v: in_medium(medium(GRID.format(
    'sigma_t', 'b.vol', PLACE) + number('scale', 3) + flag('sample_emitters', v), 'heterogeneous')), ('true', 'false'))


show('texture.volume.volume', lambda v: scene(things=wall(bsdf('diffuse', '<texture type="volume" name="reflectance">' + GRID.format(
    'volume', v, PLACE) + '</texture>'), '<scale value="1.1"/><rotate x="1" angle="80"/>') + FLOOR), ('a.vol', 'b.vol'))


def of_grid(parameter, values, element, rest=PLACE, **options):
    show(f'volume.gridvolume.{parameter}', lambda v: in_medium(medium(
        GRID.format('sigma_t', 'b.vol', rest + element(parameter, v)) + number('scale', 3), 'heterogeneous')), values, **options)


of_grid('to_world', (1.5, 2.5), lambda name, v: transform(f'<translate value="-0.5,-0.5,-0.5"/><scale value="{v}"/>'), '')
of_grid('raw', ('false', 'true'), flag, moves=False)
of_grid('use_grid_bbox', ('false', 'true'), flag, moves=False)
of_grid('filter_type', ('trilinear', 'nearest'), text, spp=4096)
SMALL = transform('<translate value="-0.5,-0.5,-0.5"/><scale value="0.9"/>')
for wrap in 'mirror', 'repeat':
    show(f'volume.gridvolume.wrap_mode {wrap}', lambda v: in_medium(medium(
        GRID.format('albedo', 'b.vol', SMALL + text('wrap_mode', v)) + number('sigma_t', 3), 'heterogeneous')), ('clamp', wrap),
        moves=wrap == 'repeat')  # of two voxels the mirror image is the same


def of_phase(kind, parameter, values, element=number, inside='', **options):
    show(f'phase.{kind}.{parameter}', lambda v: in_medium(medium(number('sigma_t', 2), phase=(
        f'<phase type="{kind}">{element(parameter, v)}{inside}</phase>'))), values, **options)


of_phase('hg', 'g', (-0.5, 0.8))
of_phase('tabphase', 'values', ('0.5, 1.0, 2.0', '2.0, 1.0, 0.2'), text)
of_phase('blendphase', 'weight', (0.2, 0.9), inside='<phase type="isotropic"/><phase type="hg">' + number('g', 0.8) + '</phase>')
show('phase.type', lambda v: in_medium(medium(number('sigma_t', 2), phase=f'<phase type="{v}"/>')), ('isotropic', 'rayleigh'))

# ---- Emitters


def of_emitter(kind, parameter, values, element=number, rest='', name=None, **options):
    show(f'emitter.{kind}.{name or parameter}', lambda v: scene(
        light=f'<emitter type="{kind}">{rest}{element(parameter, v)}</emitter>' + options.pop('beside', '')), values, **options)


of_emitter('constant', 'radiance', COLOURS, rgb)
of_emitter('envmap', 'filename', ('t.ppm', 'big.ppm'), text)
of_emitter('envmap', 'scale', (1, 2), rest=BIG)
of_emitter('envmap', 'to_world', (0, 70), lambda name, v: transform(f'<rotate x="1" angle="90"/><rotate z="1" angle="{v}"/>'), BIG)
of_emitter('envmap', 'mis_compensation', ('false', 'true'), flag, BIG, moves=False)
DAY = vector('sun_direction', '0.4,-0.5,0.8')
for parameter, values, element in (('turbidity', (2, 6), number), ('albedo', (0.1, 0.9), number), ('sun_scale', (0, 1), number),
                                   ('sky_scale', (0, 1), number), ('sun_aperture', (0.5, 5), number)):
    of_emitter('sunsky', parameter, values, element, DAY, spp=4096, moves=parameter != 'sun_aperture')
of_emitter('sunsky', 'complex_sun', ('false', 'true'), flag, DAY, spp=65536)
of_emitter('sunsky', 'second', (0, 59), spp=4096, moves=False)
of_emitter('sunsky', 'sun_direction', ('0.4,-0.5,0.8', '-0.7,-0.5,0.3'), vector, spp=4096)
of_emitter('sunsky', 'to_world', (0, 40), lambda name, v: transform(f'<rotate x="1" angle="{v}"/>'), DAY, spp=4096)
for parameter, values in ('hour', (9, 14)), ('month', (2, 7)), ('day', (1, 29)), ('year', (2010, 2011)), ('minute', (0, 50)), \
        ('latitude', (35, 60)), ('longitude', (139, 100)), ('timezone', (9, 6)):
    of_emitter('sunsky', parameter, values, integer if parameter in ('month', 'day', 'year') else number, spp=4096,
               moves=parameter != 'year')
for parameter, values, element, rest in (
        ('intensity', ('2, 3, 4', '4, 3, 2'), rgb, point('position', '-1,-2,2')),
        ('position', ('-1,-2,2', '1,-2,1'), point, rgb('intensity', 4))):
    of_emitter('point', parameter, values, element, rest)
of_emitter('point', 'to_world', (0, 2), lambda name, v: transform(f'<translate value="{v},-2,2"/>'))
for parameter, values, element, rest in (
        ('intensity', ('2, 3, 4', '4, 3, 2'), rgb, ''), ('cutoff_angle', (20, 35), number, number('beam_width', 10)),
        ('beam_width', (5, 18), number, ''), ('texture', ('t.ppm', 'big.ppm'), lambda name, v: PICTURE.format(name, v, ''), '')):
    of_emitter('spot', parameter, values, element, rest + look('-1,-2,2.5'))
of_emitter('spot', 'to_world', ('-1,-2,2.5', '1,-2,1.5'), lambda name, v: look(v))
of_emitter('directional', 'irradiance', ('2, 3, 4', '4, 3, 2'), rgb, vector('direction', '0.5,0.7,-1'))
of_emitter('directional', 'direction', ('0.5,0.7,-1', '-0.5,0.7,-0.4'), vector)
of_emitter('directional', 'to_world', ('-1,-2,2.5', '1,-2,1.5'), lambda name, v: look(v))
for parameter, values, element, rest in (
        ('scale', (1, 2), number, ''), ('irradiance', ('t.ppm', 'big.ppm'), lambda name, v: PICTURE.format(name, v, ''), ''),
        ('fov', (30, 45), number, ''), ('fov_axis', ('x', 'y'), text, number('fov', 30) + PICTURE.format('irradiance', 'wide.ppm', '')),
        ('focal_length', ('50mm', '80mm'), text, '')):
    of_emitter('projector', parameter, values, element, rest + look('-1,-2,2.5') +
               (number('fov', 30) if not parameter.startswith('fo') else ''))
of_emitter('projector', 'to_world', ('-1,-2,2.5', '1,-2,1.5'), lambda name, v: look(v) + number('fov', 30))
for parameter, values, element in ('radiance', ('2, 3, 4', '4, 3, 2'), rgb), \
        ('radiance texture', ('t.ppm', 'big.ppm'), lambda _, v: PICTURE.format('radiance', v, '')):
    show(f'emitter.area.{parameter}', lambda v, parameter=parameter, element=element: scene(light=ball(
        f'<emitter type="area">{element(parameter, v)}</emitter>', '-1.5,-1,2', 0.4)), values)


def write_files(folder):
    """Pictures, grids and meshes that the scenes name; uneven along every axis."""
    mitsuba_plugins.write_files(folder)

    def picture(name, width, height, colour):
        with open(os.path.join(folder, name), 'wb') as file:
            file.write(b'P6\n%d %d\n255\n' % (width, height))
            file.write(bytes(c for y in range(height) for x in range(width) for c in colour(x / width, y / height)))

    def wavy(x, y):
        return int(250 * x), int(250 * y * y), int(60 + 190 * x * y)

    picture('big.ppm', 8, 8, wavy)
    picture('wide.ppm', 8, 4, wavy)
    picture('n.ppm', 4, 4, lambda x, y: (128, 128, 255))
    picture('m.ppm', 4, 4, lambda x, y: (60 + int(160 * x), 190 - int(160 * y), 200))
    for name, values in ('a.vol', [0.2, 0.9, 0.4, 0.8, 0.1, 0.3, 0.7, 0.5]), ('b.vol', [0.9, 0.1, 0.8, 0.9, 0.9, 0.2, 0.6, 0.4]):
        mitsuba_plugins.write_grid(os.path.join(folder, name), values)
    write_round_meshes(folder)


def write_round_meshes(folder):
    """An octahedron whose normals are those of a ball."""
    corners = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    faces = [(a, b, c) if (a == 0) ^ (b == 2) ^ (c == 4) else (b, a, c) for a in (0, 1) for b in (2, 3) for c in (4, 5)]
    with open(os.path.join(folder, 'round.obj'), 'w') as file:
        file.writelines('v %g %g %g\n' % corner for corner in corners)
        file.writelines('vn %g %g %g\n' % corner for corner in corners)
        file.writelines('f %d//%d %d//%d %d//%d\n' % tuple(i + 1 for corner in face for i in (corner, corner)) for face in faces)
    with open(os.path.join(folder, 'round.ply'), 'w') as file:
        file.write('ply\nformat ascii 1.0\nelement vertex 6\n' + ''.join(
            f'property float {name}\n' for name in ('x', 'y', 'z', 'nx', 'ny', 'nz')) +
                   'element face 8\nproperty list uchar int vertex_indices\nend_header\n')
        file.writelines('%g %g %g %g %g %g\n' % (corner * 2) for corner in corners)
        file.writelines('3 %d %d %d\n' % face for face in faces)
    places = ((0.2, 0.1), (0.9, 0.3), (0.4, 0.8), (0.7, 0.6), (0.1, 0.9), (0.6, 0.2))
    with open(os.path.join(folder, 'uv.obj'), 'w') as file:
        file.writelines('v %g %g %g\n' % corner for corner in corners)
        file.writelines('vt %g %g\n' % place for place in places)
        file.writelines('f %d/%d %d/%d %d/%d\n' % tuple(i + 1 for corner in face for i in (corner, corner)) for face in faces)
    with open(os.path.join(folder, 'uv.ply'), 'w') as file:
        names = ('x', 'y', 'z', 'u', 'v', 'r', 'g', 'b', 'second_r', 'second_g', 'second_b')
        file.write('ply\nformat ascii 1.0\nelement vertex 6\n' + ''.join(f'property float {name}\n' for name in names) +
                   'element face 8\nproperty list uchar int vertex_indices\nend_header\n')
        for (x, y, z), (u, v) in zip(corners, places):
            file.write(f'{x} {y} {z} {u} {v} {u} {v} 0.4 {v} 0.1 {u}\n')
        file.writelines('3 %d %d %d\n' % face for face in faces)
    body = struct.pack('<I', 0x1001) + b'round\0' + struct.pack('<QQ', 6, 8)
    body += b''.join(struct.pack('<3f', *corner) for corner in corners) * 2
    body += b''.join(struct.pack('<3I', *face) for face in faces)
    with open(os.path.join(folder, 'round.serialized'), 'wb') as file:
        file.write(struct.pack('<HH', 0x041C, 4) + zlib.compress(body) + struct.pack('<QI', 0, 1))
    smaller = body.replace(b''.join(struct.pack('<3f', *corner) for corner in corners),
                           b''.join(struct.pack('<3f', *(0.6 * c for c in corner)) for corner in corners), 1)
    parts = [struct.pack('<HH', 0x041C, 4) + zlib.compress(part) for part in (body, smaller)]
    with open(os.path.join(folder, 'two.serialized'), 'wb') as file:
        file.write(b''.join(parts) + struct.pack('<QQI', 0, len(parts[0]), 2))
