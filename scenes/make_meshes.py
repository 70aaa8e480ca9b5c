"""Writes the meshes, textures and environment maps of scenes/test/mitsuba and scenes/gallery.

    python scenes/make_meshes.py        # needs numpy and mitsuba (for EXR); see tools/peers

The files are committed; run this only to change them. Meshes are closed and wind outwards.
"""
import os

import mitsuba as mi
import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))


def icosphere(levels):
    """Unit vectors and triangles of a subdivided icosahedron."""
    t = (1 + 5**0.5) / 2
    v = [(-1, t, 0), (1, t, 0), (-1, -t, 0), (1, -t, 0), (0, -1, t), (0, 1, t), (0, -1, -t), (0, 1, -t),
         (t, 0, -1), (t, 0, 1), (-t, 0, -1), (-t, 0, 1)]
    v = [np.array(p) / np.linalg.norm(p) for p in v]
    f = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6),
         (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10),
         (8, 6, 7), (9, 8, 1)]
    for _ in range(levels):
        middle, finer = {}, []

        def mid(a, b):
            key = (min(a, b), max(a, b))
            if key not in middle:
                p = v[a] + v[b]
                v.append(p / np.linalg.norm(p))
                middle[key] = len(v) - 1
            return middle[key]

        for a, b, c in f:
            ab, bc, ca = mid(a, b), mid(b, c), mid(c, a)
            finer += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        f = finer
    return np.array(v), np.array(f)


def star(levels, depth=0.3, seed_phase=0.0):
    """A rounded star: thin spikes and thick body, radius 1 - depth ... 1 + depth."""
    d, f = icosphere(levels)
    x, y, z = d.T
    r = 1 + depth * np.sin(4 * x + seed_phase) * np.sin(4 * y + 1) * np.sin(4 * z + 2) * 2.2
    return d * r[:, None], f


def torus_knot(along, around, p=2, q=3, tube=0.28, radius=0.75, flat=0.35):
    """A (p, q) torus knot as a closed tube."""
    t = np.arange(along) / along * 2 * np.pi

    def curve(t):
        r = radius + flat * np.cos(q * t)
        return np.stack([r * np.cos(p * t), r * np.sin(p * t), -flat * 1.2 * np.sin(q * t)], -1)

    c, e = curve(t), 1e-4
    tangent = curve(t + e) - curve(t - e)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    radial = c - np.array([0, 0, 0.0])
    b = np.cross(tangent, radial)
    b /= np.linalg.norm(b, axis=1, keepdims=True)
    n = np.cross(b, tangent)
    a = np.arange(around) / around * 2 * np.pi
    v = c[:, None] + tube * (np.cos(a)[None, :, None] * n[:, None] + np.sin(a)[None, :, None] * b[:, None])
    f = []
    for i in range(along):
        for j in range(around):
            k, l = (i + 1) % along, (j + 1) % around
            f += [(i * around + j, k * around + j, k * around + l), (i * around + j, k * around + l, i * around + l)]
    return v.reshape(-1, 3), np.array(f)


def rounded_box(n, half=(1, 1, 1), corner=0.15):
    """A box with rounded edges: the boundary of a box grown by a ball; n cells a side of the cube it starts from."""
    g = np.linspace(-1, 1, n + 1)
    index, v, f = {}, [], []

    def vertex(p):
        key = tuple(np.round(p * 1e6).astype(int))
        if key not in index:
            index[key] = len(v)
            v.append(np.array(p))
        return index[key]

    for axis in range(3):
        for side in (-1, 1):
            for i in range(n):
                for j in range(n):
                    quad = []
                    for a, b in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)):
                        p = np.zeros(3)
                        p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3] = side, g[a], g[b]
                        quad.append(vertex(p))
                    if side < 0:
                        quad.reverse()
                    f += [(quad[0], quad[1], quad[2]), (quad[0], quad[2], quad[3])]
    v, half = np.array(v), np.array(half)
    core = half - corner
    # Spread the grid so that the outermost cells cover the rounding.
    p = np.sign(v) * np.abs(v)**0.5 * half
    inner = np.clip(p, -core, core)
    d = p - inner
    d /= np.maximum(np.linalg.norm(d, axis=1, keepdims=True), 1e-12)
    return inner + corner * d, np.array(f)


def vertex_normals(v, f):
    face = np.cross(v[f[:, 1]] - v[f[:, 0]], v[f[:, 2]] - v[f[:, 0]])
    n = np.zeros_like(v)
    for k in range(3):
        np.add.at(n, f[:, k], face)
    return n / np.linalg.norm(n, axis=1, keepdims=True)


def waves(n):
    """A square sheet with hills, seen from above: vertices, faces and texture coordinates that are not along its edges."""
    y, x = np.mgrid[:n + 1, :n + 1] / n
    v = np.stack([2 * x - 1, 2 * y - 1, .15 * np.sin(7 * x + 1) * np.cos(5 * y)], -1).reshape(-1, 3)
    a = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    f = np.vstack([np.stack([a, a + 1, a + n + 2], 1), np.stack([a, a + n + 2, a + n + 1], 1)])
    return v, f, np.stack([x + .3 * y, 1.2 * y - .1 * x], -1).reshape(-1, 2)


def bumps(size):
    """Heights that wrap around, and the normals of something else that does."""
    y, x = np.mgrid[:size, :size] * 2 * np.pi / size
    heights = .15 + .08 * np.sin(2 * x) + .06 * np.cos(3 * y + x)
    normals = np.stack([.4 * np.cos(2 * x + y), .5 * np.sin(3 * y), np.ones_like(x)], -1)
    return heights[..., None], .5 + .5 * normals / np.linalg.norm(normals, axis=-1, keepdims=True)


def write_ply(path, v, f, normals, uv=None):
    volume = np.einsum('ij,ij->i', v[f[:, 0]], np.cross(v[f[:, 1]], v[f[:, 2]])).sum() / 6
    if volume < 0 and uv is None:
        f = f[:, ::-1]
    names = ['x', 'y', 'z']
    data = v
    if normals:
        names += ['nx', 'ny', 'nz']
        data = np.hstack([v, vertex_normals(v, f)])
    if uv is not None:
        names += ['u', 'v']
        data = np.hstack([data, uv])
    header = ['ply', 'format binary_little_endian 1.0', f'element vertex {len(v)}']
    header += [f'property float {name}' for name in names]
    header += [f'element face {len(f)}', 'property list uchar int vertex_indices', 'end_header', '']
    faces = np.zeros(len(f), dtype=[('n', 'u1'), ('i', '<i4', 3)])
    faces['n'], faces['i'] = 3, f
    with open(os.path.join(HERE, path), 'wb') as out:
        out.write('\n'.join(header).encode() + data.astype('<f4').tobytes() + faces.tobytes())


def paint(path, to):
    """A mesh of write_ply with normals, with attributes as Mitsuba names them: vertex_color, vertex_rough, face_tile,
    face_weight."""
    with open(os.path.join(HERE, path), 'rb') as mesh:
        data = mesh.read()
    header, body = data[:data.index(b'end_header\n')].decode(), data[data.index(b'end_header\n') + 11:]
    vertices, faces = (int(line.split()[2]) for line in header.splitlines() if line.startswith('element'))
    v = np.frombuffer(body, '<f4', vertices * 6).reshape(vertices, 6)
    f = np.frombuffer(body, [('n', 'u1'), ('i', '<i4', 3)], faces, vertices * 24)
    up, radius = v[:, 2], np.linalg.norm(v[:, :3], axis=1)
    colour = np.stack([.1 + .8 * (up - up.min()) / np.ptp(up), .5 + .45 * v[:, 3], .5 + .4 * v[:, 4]], 1)
    rough = .15 + .6 * (radius - radius.min()) / np.ptp(radius)
    random = np.random.default_rng(4)
    painted = np.zeros(faces, [('n', 'u1'), ('i', '<i4', 3), ('c', '<f4', 4)])
    painted['n'], painted['i'] = 3, f['i']
    painted['c'][:, :3] = np.round(.1 + .8 * random.random((faces, 3)), 3)
    painted['c'][:, 3] = .2 + .6 * random.random(faces)
    names = [[f'property float {name}' for name in group.split()]
             for group in ('r g b rough_0', 'tile_x tile_y tile_z weight_0')]
    lines = header.splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith('element face'))
    lines = lines[:at] + names[0] + lines[at:] + names[1] + ['end_header', '']
    with open(os.path.join(HERE, to), 'wb') as out:
        out.write('\n'.join(lines).encode() + np.hstack([v, colour, rough[:, None]]).astype('<f4').tobytes())
        out.write(painted.tobytes())


def write_exr(path, pixels, component=mi.Struct.Type.Float16):
    mi.Bitmap(pixels.astype(np.float32)).convert(component_format=component).write(
        os.path.join(HERE, path))


def directions(height):
    """Directions (z up) of the pixels of a latitude-longitude map turned by rotate x 90 (Mitsuba's maps have y up)."""
    v, u = np.meshgrid((np.arange(height) + .5) / height, (np.arange(2 * height) + .5) / (2 * height), indexing='ij')
    theta, phi = v * np.pi, u * 2 * np.pi
    return np.stack([np.sin(phi) * np.sin(theta), np.cos(phi) * np.sin(theta), np.cos(theta)], -1)


def environment(height, lamps, ground, horizon, zenith):
    """A gradient from ground over horizon to zenith, and soft lamps (direction, width [rad], RGB peak)."""
    d = directions(height)
    up = d[..., 2:]
    sky = np.where(up > 0, np.array(horizon) + (np.array(zenith) - horizon) * np.abs(up)**.6,
                   np.array(horizon) + (np.array(ground) - horizon) * np.abs(up)**.3)
    for direction, width, peak in lamps:
        c = d @ (np.array(direction) / np.linalg.norm(direction))
        sky = sky + np.exp((c - 1) / width**2)[..., None] * np.array(peak)
    return sky


def checker(size, cells, dark, light):
    y, x = np.mgrid[:size, :size] * cells // size
    return np.where(((x + y) % 2)[..., None] == 0, np.array(dark), np.array(light))


def inlay(size=64):
    """Albedos: a star of eight fields in a ring, red and blue in white."""
    y, x = (np.mgrid[:size, :size] + .5) / size * 2 - 1
    r, angle = np.hypot(x, y), np.arctan2(y, x)
    picture = np.full((size, size, 3), (.98, .97, .95))
    star = r < .38 + .3 * np.cos(4 * angle) ** 2
    picture[star & (np.sin(8 * angle) > 0)] = (.93, .4, .2)
    picture[star & (np.sin(8 * angle) <= 0)] = (.25, .45, .88)
    picture[(r > .78) & (r < .88)] = (.15, .4, .85)
    return picture


def data_set_floor():
    """The numbers of floor_pattern() in network/dataset/dataset_scene.cpp: random_uniform(7, 0, i) of runtime/base/random.h."""
    mask = (1 << 64) - 1

    def mixed(x):
        x = (x + 0x9e3779b97f4a7c15) & mask
        x = ((x ^ (x >> 30)) * 0xbf58476d1ce4e5b9) & mask
        x = ((x ^ (x >> 27)) * 0x94d049bb133111eb) & mask
        return x ^ (x >> 31)

    def uniform(i):
        return ((mixed(mixed(mixed(7)) ^ i) >> 12) + .5) * 2.**-52

    return np.array([[(.25 if (x + y) % 2 == 0 else .55) + .1 * uniform(16 * y + x) for x in range(16)]
                     for y in range(16)])[..., None]


def main():
    mi.set_variant('scalar_rgb')
    for folder in ('test/mitsuba', 'gallery', 'dataset'):
        os.makedirs(os.path.join(HERE, folder), exist_ok=True)
    test = 'test/mitsuba/'
    write_ply(test + 'star.ply', *star(3), normals=False)
    write_ply(test + 'star_smooth.ply', *star(3), normals=True)
    paint(test + 'star_smooth.ply', test + 'star_painted.ply')
    write_ply(test + 'knot.ply', *torus_knot(90, 10), normals=False)
    write_exr(test + 'sky.exr', environment(16, [((1, -1, 1.2), .35, (9, 8, 6)), ((-1, -.3, .2), .25, (.5, 2, 5))],
                                            (.1, .08, .05), (.6, .5, .4), (.2, .4, .9)))
    # Not symmetric in u or v, so that a flip shows.
    tiles = checker(16, 8, (.1, .15, .25), (.8, .7, .5))
    tiles[:4, :8] = (.7, .1, .1)
    write_exr(test + 'tiles.exr', tiles)
    # Copper and aluminium in turn.
    write_exr(test + 'metal_eta.exr', checker(8, 4, (.20, .92, 1.10), (1.66, .88, .52)))
    write_exr(test + 'metal_k.exr', checker(8, 4, (3.91, 2.45, 2.14), (9.22, 6.27, 4.84)))
    v, f, uv = waves(12)
    write_ply(test + 'waves.ply', v, f, normals=True, uv=uv)
    heights, normals = bumps(32)
    write_exr(test + 'bumps.exr', heights, mi.Struct.Type.Float32)
    write_exr(test + 'normals.exr', normals, mi.Struct.Type.Float32)
    holes = np.random.default_rng(3).uniform(size=(8, 8, 1))
    write_exr(test + 'holes.exr', np.where(holes < .4, 0, np.where(holes < .55, .5, 1)), mi.Struct.Type.Float32)
    above = np.ones((512, 4, 3))
    above[256:] = 0
    write_exr('test/above.exr', above)
    write_exr('test/uniform.exr', np.ones((4, 8, 3)))
    gallery = 'gallery/'
    write_ply(gallery + 'knot.ply', *torus_knot(240, 24), normals=True)
    write_ply(gallery + 'blob.ply', *star(4, .25, .7), normals=True)
    write_ply(gallery + 'bar.ply', *rounded_box(16, (1, .62, .45), .14), normals=True)
    write_exr(gallery + 'studio.exr', environment(64, [((1, -1.2, 1.4), .22, (22, 20, 17)),
                                                       ((-1.2, -.4, .5), .18, (3, 5, 9)),
                                                       ((-.2, 1, .6), .3, (4, 3, 2.4))],
                                                  (.05, .05, .05), (.25, .25, .27), (.1, .12, .16)))
    write_exr(gallery + 'tiles.exr', checker(256, 16, (.12, .13, .15), (.62, .60, .56)))
    write_exr(gallery + 'inlay.exr', inlay())
    write_exr(gallery + 'dim.exr', np.full((24, 48, 3), .3))
    v, f = star(3)
    v = (v - (v.min(0) + v.max(0)) / 2) / (v.max(0) - v.min(0)).max()
    write_ply('dataset/star.ply', v - [0, 0, v[:, 2].min()], f, normals=True)
    write_exr('dataset/floor.exr', data_set_floor(), mi.Struct.Type.Float32)
    grain = np.random.default_rng(1).normal(size=(128, 16, 1))
    grain = np.repeat(np.cumsum(grain, 0) * .012, 8, 1)
    write_exr(gallery + 'wood.exr', np.clip(np.array([.42, .27, .15]) * (1 + grain), .02, .9))


if __name__ == '__main__':
    main()
