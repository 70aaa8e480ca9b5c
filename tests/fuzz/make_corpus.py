#!/usr/bin/env python3
"""Writes the first files of the fuzzers' corpora: small, one of each kind that a reader tells apart."""
import json
import pathlib
import struct
import zlib

ROOT = pathlib.Path(__file__).parent / "corpus"


def write(reader, name, data):
    path = ROOT / reader / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data.encode() if isinstance(data, str) else data)


def ply():
    vertices = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    faces = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]
    position = "property float x\nproperty float y\nproperty float z\n"
    face = "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    head = "ply\nformat %s 1.0\ncomment made here\nelement vertex 4\n" + position
    rows = "".join("%g %g %g\n" % v for v in vertices) + "".join("3 %d %d %d\n" % f for f in faces)
    write("ply", "ascii.ply", head % "ascii" + face + rows)
    for order, mark in (("binary_little_endian", "<"), ("binary_big_endian", ">")):
        body = b"".join(struct.pack(mark + "3f", *v) for v in vertices)
        body += b"".join(struct.pack(mark + "B3i", 3, *f) for f in faces)
        write("ply", order + ".ply", (head % order + face).encode() + body)
    more = "property float nx\nproperty float ny\nproperty float nz\nproperty float u\nproperty float v\n" \
           "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty float heat_x\n"
    rows = "".join("%g %g %g 0 0 1 0.5 0.5 1 2 3 4\n" % v for v in vertices) + "".join("3 %d %d %d\n" % f for f in faces)
    write("ply", "attributes.ply", head % "ascii" + more + face + rows)
    write("ply", "twice.ply", "ply\nformat ascii 1.0\nelement vertex 3\n" + position + "property float nx\nproperty float ny\n"
          "property float nz\nelement vertex 3\n" + position + face)
    write("ply", "list.ply", "ply\nformat ascii 1.0\nelement edge 1\nproperty list uint float a\nend_header\n4294967295 1\n")


def obj():
    write("obj", "all.obj", "# made here\no a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0.5\nvn 0 0 1\nf 1/1/1 3/1/1 2/1/1\n"
          "f 1 2 4\nf 2//1 3//1 \\\n4//1\nf -4/1 4/1 3/1\n")
    write("obj", "quad.obj", "v 0 0 0\r\nv 1 0 0\r\nv 1 1 0\r\nv 0 1 0\r\ng x\r\nusemtl y\r\nf 1 2 3 4\r\n")
    write("obj", "index.obj", "v 0 0 0\nf 1 2 99999999999\n")


def serialized():
    body = struct.pack("<I", 0x1000) + b"name\0" + struct.pack("<QQ", 3, 1)
    body += struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0) + struct.pack("<3I", 0, 1, 2)
    for level in (0, 9):
        data = struct.pack("<HH", 0x041C, 4) + zlib.compress(body, level)
        write("serialized", "level%d.serialized" % level, data + data + struct.pack("<QQI", 0, len(data), 2))
    body = struct.pack("<I", 0x2000 | 1 | 2 | 8) + struct.pack("<QQ", 3, 1) + b"\0" * (8 * 3 * 11) + struct.pack("<3I", 0, 1, 2)
    write("serialized", "double.serialized", struct.pack("<HH", 0x041C, 3) + zlib.compress(body, 0) + struct.pack("<II", 0, 1))


def vol():
    def grid(width, height, depth, channels, values):
        return b"VOL\3" + struct.pack("<5i6f", 1, width, height, depth, channels, 0, 0, 0, 1, 1, 1) + values
    write("vol", "one.vol", grid(1, 1, 1, 1, struct.pack("<f", 1)))
    write("vol", "colour.vol", grid(2, 1, 2, 3, struct.pack("<12f", *range(12))))
    write("vol", "large.vol", grid(1 << 20, 1 << 20, 1 << 20, 3, b""))


def exr(width=2, height=2, compression=0, channels=("B", "G", "R"), attributes=(), window=None):
    def attribute(name, kind, value):
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value
    box = struct.pack("<4i", *(window or (0, 0, width - 1, height - 1)))
    listed = b"".join(c.encode() + b"\0" + struct.pack("<iB3xii", 2, 0, 1, 1) for c in channels) + b"\0"
    head = struct.pack("<iI", 20000630, 2) + attribute("channels", "chlist", listed)
    head += attribute("compression", "compression", bytes([compression])) + attribute("dataWindow", "box2i", box)
    head += attribute("displayWindow", "box2i", struct.pack("<4i", 0, 0, width - 1, height - 1))
    head += attribute("lineOrder", "lineOrder", b"\0") + attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
    head += attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)) + attribute("screenWindowWidth", "float", struct.pack("<f", 1))
    for entry in attributes:
        head += attribute(*entry)
    head += b"\0"
    row = struct.pack("<%df" % (width * len(channels)), *range(width * len(channels)))
    chunks, table, at = b"", b"", len(head) + 8 * height
    for y in range(height):
        chunk = struct.pack("<ii", y + (window or (0, 0))[1], len(row)) + row
        table += struct.pack("<Q", at + len(chunks))
        chunks += chunk
    return head + table + chunks


def jpeg(exif=b""):
    """8 x 8 grey pixels of one value, with the shortest tables."""
    def segment(kind, data):
        return b"\xff" + kind + struct.pack(">H", len(data) + 2) + data
    table = b"\1" + b"\0" * 16  # one code of one bit, for 0
    return (b"\xff\xd8" + (segment(b"\xe1", exif) if exif else b"") + segment(b"\xdb", b"\0" + b"\1" * 64)
            + segment(b"\xc0", struct.pack(">BHHBBBB", 8, 8, 8, 1, 1, 0x11, 0)) + segment(b"\xc4", b"\0" + table)
            + segment(b"\xc4", b"\x10" + table) + segment(b"\xda", b"\1\1\0\0\x3f\0") + b"\x3f\xff\xd9")


def tiff(width, height, channels, bits, data, compression=1):
    at = 8 + len(data) + len(data) % 2
    tags = [(256, 4, 1, width), (257, 4, 1, height), (258, 3, channels, 0), (259, 3, 1, compression),
            (262, 3, 1, 1 if channels < 3 else 2), (273, 4, 1, 8), (277, 3, 1, channels), (278, 4, 1, height),
            (279, 4, 1, len(data))] + ([(338, 3, 1, 2)] if channels in (2, 4) else [])
    end = at + 2 + 12 * len(tags) + 4
    value = {2: bits | bits << 16}.get(channels, bits if channels == 1 else end)
    tags = [(n, k, c, value if n == 258 else v) for n, k, c, v in tags]
    return (struct.pack("<2sHI", b"II", 42, at) + data.ljust(at - 8, b"\0") + struct.pack("<H", len(tags))
            + b"".join(struct.pack("<HHII", *tag) for tag in tags) + struct.pack("<I", 0) + struct.pack("<%dH" % channels, *[bits] * channels))


def images():
    write("exr", "colour.exr", exr())
    write("exr", "text.exr", exr(channels=("Y", "stderr.Y"), attributes=[("hash", "string", b"0123456789abcdef")]))
    write("exr", "moved.exr", exr(window=(1, 1, 2, 2)))
    write("exr", "large.exr", exr(window=(0, 0, 29999, 29999)))
    write("exr", "zip.exr", exr(compression=3))
    write("exr", "preview.exr", exr(attributes=[("preview", "preview", struct.pack("<II", 30000, 30000))]))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    def png(width, height, depth, kind, data, more=b""):
        head = struct.pack(">IIBBBBB", width, height, depth, kind, 0, 0, 0)
        return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + more + chunk(b"IDAT", zlib.compress(data)) + chunk(b"IEND", b"")
    write("image", "rgb.png", png(2, 2, 8, 2, b"\0" + b"\1\2\3" * 2 + b"\1" + b"\4\5\6" * 2))
    write("image", "grey16.png", png(1, 1, 16, 0, b"\0\1\2"))
    write("image", "palette.png", png(4, 1, 2, 3, b"\0\x1b", chunk(b"PLTE", bytes(range(12)))))
    write("image", "large.png", png(30000, 30000, 1, 0, b"\0" * 100))
    pixels = bytes(range(12))
    write("jpeg", "grey.jpg", jpeg())
    write("jpeg", "turned.jpg", jpeg(b"Exif\0\0II*\0\x08\0\0\0\1\0\x12\1\3\0\1\0\0\0\6\0\0\0\0\0\0\0"))
    write("tiff", "rgb.tif", tiff(2, 2, 3, 8, pixels))
    write("tiff", "alpha16.tif", tiff(1, 2, 2, 16, pixels[:8]))
    write("tiff", "packed.tif", tiff(4, 1, 1, 8, b"\xfd\x40", 32773))
    write("tiff", "deflate.tif", tiff(2, 2, 3, 8, zlib.compress(pixels), 8))
    write("tiff", "large.tif", tiff(30000, 30000, 1, 8, b"a"))
    write("image", "a.ppm", b"P6\n2 2\n255\n" + pixels)
    write("image", "a.pgm", b"P5 2 2 65535\n" + pixels)
    write("image", "a.tga", b"\0\0\2" + b"\0" * 9 + b"\2\0\2\0\x18\0" + pixels)
    write("image", "rle.tga", b"\0\0\x0a" + b"\0" * 9 + b"\4\0\1\0\x18\0" + b"\x83\1\2\3")
    write("image", "a.bmp", b"BM" + struct.pack("<IIIIiiHHIIIIII", 0, 0, 54, 40, 2, 1, 1, 24, 0, 0, 0, 0, 0, 0) + pixels[:8])
    write("image", "a.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n" + pixels[:8])
    write("image", "rle.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 8\n\2\2\0\x08" + b"\x88\1" * 4)


def texts():
    def tensors(header, data):
        text = json.dumps(header).encode()
        return struct.pack("<Q", len(text)) + text + data
    one = {"dtype": "F32", "shape": [1, 2], "data_offsets": [0, 8]}
    write("safetensors", "one", tensors({"__metadata__": {"a": "b"}, "w": one}, struct.pack("<2f", 1, 2)))
    write("safetensors", "half", tensors({"w": {"dtype": "F16", "shape": [2], "data_offsets": [0, 4]}}, b"\0\x3c\0\x40"))
    write("safetensors", "deep", tensors({}, b"") + b"[" * 500)
    write("safetensors", "overflow", tensors({"w": {"dtype": "F32", "shape": [1 << 62, 8], "data_offsets": [0, 8]}}, b"\0" * 8))
    manifest = {
        "schema": "itn.dataset/1", "version": "1", "hash": "0123456789abcdef", "complete": True, "config": {}, "size": 8,
        "spp": 16, "mm_per_unit": 1, "boundary": {"type": "rough", "alpha": 0.1, "int_ior": 1.3},
        "shapes": [{"name": "a", "role": "train", "buffers": "shapes/a.exr", "mesh": {"named": "ball"}},
                   {"name": "b", "role": "test", "buffers": "shapes/b.exr", "mesh": {"random": 1, "triangles": 100}}],
        "lights": [{"azimuth": 0, "zenith": 0, "direction": [0, 0, 1]},
                   {"azimuth": 0, "environment": "e.exr", "scale": 1, "direction": [0, 0, 1]}],
        "images": [{"file": "images/0.exr", "split": "train", "shape": 0, "light": 0, "sigma_t": 1, "albedo": 0.5, "g": 0,
                    "seed": 18446744073709551615},
                   {"file": "images/1.exr", "split": "unseen_both", "shape": 1, "light": 1, "sigma_t": 1, "albedo": 0.5,
                    "g": 0, "seed": 0}]}
    write("manifest", "whole.json", json.dumps(manifest))
    write("manifest", "empty.json", "{}")
    write("json", "all.json", '{"a": [1, -2.5e3, true, false, null, "\\u00e4\\ud83d\\ude00"], "b": {}}')
    write("json", "deep.json", "[" * 200)
    write("json", "text.json", '"' + "[" * 200 + '\\""')


def scenes():
    body = """<default name="g" value="0.5"/><path value="."/><include filename="part.xml"/>
<integrator type="volpath"><integer name="max_depth" value="-1"/></integrator>
<medium type="homogeneous" id="skin"><spectrum name="sigmaT" filename="a.spd"/><float name="albedo" value="0.9"/>
<phase type="hg"><float name="g" value="$g"/></phase></medium>
<sensor type="perspective"><string name="fov_axis" value="smaller"/><float name="fov" value="40"/>
<transform name="to_world"><lookat origin="0,0,-5" target="0,0,0" up="0,1,0"/></transform>
<film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="4"/><rfilter type="box"/></film>
<sampler type="independent"><integer name="sample_count" value="16"/></sampler></sensor>
<bsdf type="twosided" id="floor"><bsdf type="diffuse"><ref name="reflectance" id="grey"/></bsdf></bsdf>
<spectrum type="irregular" id="gray"><string name="wavelengths" value="400 700"/><string name="values" value="0.1 1"/></spectrum>
<alias id="gray" as="grey"/>
<shape type="ply"><string name="filename" value="t.ply"/><transform name="to_world"><rotate y="1" angle="30"/><scale value="2"/>
</transform><bsdf type="roughdielectric"><float name="alpha" value="0.2"/><string name="int_ior" value="water"/></bsdf>
<ref name="interior" id="skin"/></shape><shape type="rectangle"><ref id="floor"/></shape>
<emitter type="sunsky"><vector name="sun_direction" x="0" y="1" z="1"/></emitter>"""
    mesh = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\n" \
           "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n"
    files = "\n=== part.xml\n<bsdf version=\"3.0.0\" type=\"null\"/>\n=== a.spd\n400 1\n500 2\n700 3\n=== t.ply\n" + mesh
    write("scene", "files.xml", '<scene version="0.6.0">' + body + "</scene>" + files)

    def scene(name, inside, more=""):
        write("scene", name, '<scene version="3.0.0">' + inside + "</scene>" + more)
    number, rgb, text = '<float name="%s" value="%s"/>', '<rgb name="%s" value="%s"/>', '<string name="%s" value="%s"/>'
    ball = '<shape type="sphere">%s</shape>'
    bsdf = '<bsdf type="%s">%s</bsdf>'
    scene("surfaces.xml", "".join(ball % (bsdf % (kind, inside)) for kind, inside in (
        ("dielectric", number % ("int_ior", 1.5)), ("thindielectric", ""), ("conductor", text % ("material", "Au")),
        ("roughconductor", number % ("alpha_u", 0.1) + number % ("alpha_v", 0.3) + text % ("distribution", "ggx")),
        ("plastic", rgb % ("diffuse_reflectance", "0.1 0.2 0.3")), ("roughplastic", number % ("alpha", 0.2)),
        ("principled", number % ("roughness", 0.5) + number % ("spec_trans", 0.5)), ("oren_nayar", number % ("alpha", 0.3)),
        ("ward", ""), ("ashikhmin_shirley", number % ("nu", 10)),
        ("blendbsdf", number % ("weight", 0.5) + 2 * (bsdf % ("diffuse", ""))),
        ("mask", number % ("opacity", 0.5) + bsdf % ("diffuse", "")),
        ("dictionary", text % ("weights", "0.5 0.5") + 2 * (bsdf % ("diffuse", ""))),
        ("merl", text % ("filename", "a.binary")))) + '<emitter type="constant"/>')
    scene("textures.xml", ball % (bsdf % ("diffuse", '<texture name="reflectance" type="bitmap"><string name="filename" '
          'value="a.ppm"/><transform name="to_uv"><scale value="2"/></transform></texture>')) +
          ball % (bsdf % ("bumpmap", '<texture type="checkerboard"/>' + bsdf % ("diffuse", ""))) +
          '<emitter type="envmap"><string name="filename" value="a.ppm"/></emitter>', "\n=== a.ppm\nP3 2 2 255 0 1 2 3 4 5 6 7 8 9 10 11")
    scene("media.xml", "".join('<medium type="homogeneous" id="m%d">%s</medium>' % (i, inside) for i, inside in enumerate((
        '<phase type="rayleigh"/>', '<phase type="draine"/>', '<phase type="vmf"/>',
        '<phase type="tabphase"><string name="values" value="1 2 3"/></phase>',
        '<phase type="blendphase"><float name="weight" value="0.5"/><phase type="hg"/><phase type="isotropic"/></phase>'))) +
        '<medium type="heterogeneous" id="h"><volume name="sigma_t" type="gridvolume"><string name="filename" value="a.vol"/></volume>'
        '<volume name="albedo" type="constvolume"><float name="value" value="0.5"/></volume></medium>' +
        ball % '<ref name="interior" id="h"/><bsdf type="null"/>',
        "\n=== a.vol\n" + (b"VOL\3" + struct.pack("<5i6f", 1, 1, 1, 1, 1, 0, 0, 0, 1, 1, 1) + struct.pack("<f", 1)).decode("latin1"))
    scene("shapes.xml", "".join('<shape type="%s">%s</shape>' % each for each in (
        ("cube", ""), ("disk", ""), ("cylinder", number % ("radius", 2)), ("rectangle", '<emitter type="area"/>'),
        ("linearcurve", text % ("filename", "a.txt")), ("bsplinecurve", text % ("filename", "a.txt")),
        ("obj", text % ("filename", "a.obj")), ("shapegroup", '<shape type="sphere"/>'))) +
        '<shape type="shapegroup" id="g"><shape type="sphere"/></shape><shape type="instance"><ref id="g"/></shape>',
        "\n=== a.txt\n0 0 0 1\n1 0 0 1\n2 0 0 0.5\n3 1 0 1\n=== a.obj\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    scene("lights.xml", "".join('<emitter type="%s"/>' % kind for kind in ("point", "spot", "directional", "projector")) +
          '<emitter type="sphericalharmonics"><integer name="order" value="1"/></emitter>' +
          "".join('<sensor type="%s"/>' % kind for kind in ("orthographic", "thinlens", "radiancemeter", "distant")))


def states():
    write("config", "own.json", json.dumps({
        "preset": "tiny", "size": 16, "spp": 8, "seed": 1, "sigma_t": [1, 2], "albedo": [0.1, 0.2], "g": [0, 0.5], "zenith": 20,
        "boundary": {"type": "rough", "alpha": 0.1, "int_ior": 1.3}, "longest_side_mm": 2, "environment_scale": 2,
        "train": {"shapes": ["knot", "a.ply"], "random_shapes": 1, "triangles": 200, "azimuths": [0, 30], "materials": 2},
        "test": {"shapes": ["hare"], "azimuths": [], "azimuth_range": [0, 90], "materials": 1, "environments": ["a.exr"],
                 "environment_azimuths": [0, 90]}}))
    write("config", "empty.json", "{}")
    write("spectrum", "a.spd", "# nm value\n400 0.1\n500.5, 2\n700 1e-3 # end\n")
    write("curves", "a.txt", "0 0 0 1\n1 0 0 1\n2 0.5 0 0.5\n3 1 0 1\n\n0 0 1 0.1\n1 0 1 0.1\n")
    write("merl", "header.binary", struct.pack("<3i", 90, 90, 180) + b"\0" * 8)
    write("checkpoint", "progress.json", json.dumps({"steps": 4, "sums": [0.5, 0, 0], "curve": [[1, 0, 2], [0.5, 0, 1]], "best_epoch": 1}))
    write("checkpoint", "begin.json", json.dumps({"steps": 1, "sums": [0.5, 0, 0], "curve": [], "best_epoch": 0}))
    x = [0.1, 0.2, 0.3]
    state = {"iteration": 1, "spp": 16, "next_sample": 16, "x": x, "done": False, "converged": False, "joined": -1, "reference_x": [],
             "accepted_x": x, "reference_spp": 0, "reference_sample": 0, "accepted_loss": 1, "accepted_loss_stderr": 0.1,
             "damping": 0.01, "accepted": True, "pool": [], "moments": {"first": x, "second": []}}
    pooled = dict(state, pool=[0.5] * (2 + 3 + 7 * 9), done=True)
    steps = [[16, x, 1.5, None, True, 0.5], [16, x, 1, 0.5, False, 0]]
    for name, runs in (("adam.json", [(state, 1)]), ("pool.json", [(pooled, 2), (state, 1)])):
        write("inversion", name, json.dumps({"schema": "itn.invert.state/4", "request": {"seed": 5},
                                             "runs": [{"start": x[:2], "state": s, "steps": steps[:n]} for s, n in runs]}))
    # A network for images of one pixel, of whose kernels the middles are stored.
    channels, tensors = [1] + [1 << stage for stage in range(7)], []
    for stage in range(7):
        tensors.append(("convolution%d.weight" % stage, [channels[stage + 1], channels[stage], 1, 1]))
        tensors.append(("convolution%d.bias" % stage, [channels[stage + 1]]))
    tensors += [("fully_connected.weight", [3, 64]), ("fully_connected.bias", [3])]
    outputs = [{"name": name, "low": low, "high": high, "logarithmic": log}
               for name, low, high, log in (("sigma_t", 10, 400, True), ("albedo", 0.1, 1, False), ("g", 0, 0.95, False))]
    header = {"__metadata__": {"format": "itn.network", "version": "1", "kind": "rn", "channels": "1", "size": "1", "width": "1",
                               "luminance": "1.0", "mm_per_unit": "1.0", "outputs": json.dumps(outputs)}}
    at = 0
    for name, shape in tensors:
        size = 2
        for extent in shape:
            size *= extent
        header[name] = {"dtype": "F16", "shape": shape, "data_offsets": [at, at + size]}
        at += size
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    write("network", "small", struct.pack("<Q", len(text)) + text + b"\x00\x2c" * (at // 2))


for make in (ply, obj, serialized, vol, images, texts, scenes, states):
    make()
