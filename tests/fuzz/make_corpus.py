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
    write("serialized", "double.serialized", struct.pack("<HH", 0x041C, 3) + zlib.compress(body, 0))


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
    write("image", "grey.jpg", jpeg())
    write("image", "turned.jpg", jpeg(b"Exif\0\0II*\0\x08\0\0\0\1\0\x12\1\3\0\1\0\0\0\6\0\0\0\0\0\0\0"))
    write("image", "rgb.tif", tiff(2, 2, 3, 8, pixels))
    write("image", "alpha16.tif", tiff(1, 2, 2, 16, pixels[:8]))
    write("image", "packed.tif", tiff(4, 1, 1, 8, b"\xfd\x40", 32773))
    write("image", "deflate.tif", tiff(2, 2, 3, 8, zlib.compress(pixels), 8))
    write("image", "large.tif", tiff(30000, 30000, 1, 8, b"a"))
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


for make in (ply, obj, serialized, vol, images, texts):
    make()
