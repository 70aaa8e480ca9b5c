#!/usr/bin/env python3
"""What a camera makes of a rendered image: camera.py IMAGE.exr PHOTO.png [--exposure E] [--white-balance R,G,B]
[--electrons N] [--read-noise N] [--seed N] [--linear16]

Each value of IMAGE, which `itn render` wrote, times exposure and white balance, becomes electrons: 1.0 fills a pixel's well of N
electrons. They are counted (Poisson's noise, as a normal one of the same variance) and read out (the noise of the amplifier), cut
off at the well's end, bent by the curve of sRGB, and rounded to 8 bits. With --linear16 they are written as they are, as a TIFF file
of 16 bits. Needs nothing but Python.
"""
import argparse
import random
import struct
import zlib


def read_exr(path):
    """Width, height and rows of (R, G, B) of an OpenEXR file as itn writes them: float32, scanlines, ZIP."""
    data = open(path, "rb").read()
    at, channels, size = 8, [], (0, 0)
    while data[at]:
        name, at = data[at:data.index(0, at)], data.index(0, at) + 1
        at = data.index(0, at) + 1
        length, = struct.unpack_from("<i", data, at)
        value, at = data[at + 4:at + 4 + length], at + 4 + length
        if name == b"channels":
            channels = [c.split(b"\0")[0].decode() for c in split_channels(value)]
        if name == b"dataWindow":
            x0, y0, x1, y1 = struct.unpack("<4i", value)
            size = (x1 - x0 + 1, y1 - y0 + 1)
    width, height = size
    offsets = struct.unpack_from(f"<{(height + 15) // 16}Q", data, at + 1)
    rows = []
    for k, offset in enumerate(offsets):
        length, = struct.unpack_from("<i", data, offset + 4)
        lines = min(16, height - 16 * k)
        block = unpacked(data[offset + 8:offset + 8 + length], 4 * width * lines * len(channels))
        for line in range(lines):
            planes = {c: struct.unpack_from(f"<{width}f", block, 4 * width * (line * len(channels) + i))
                      for i, c in enumerate(channels) if c in ("R", "G", "B")}
            rows.append(list(zip(planes["R"], planes["G"], planes["B"])))
    return width, height, rows


def split_channels(value):
    at, result = 0, []
    while value[at]:
        end = value.index(0, at)
        result.append(value[at:end])
        at = end + 17
    return result


def unpacked(packed, size):
    """OpenEXR's ZIP: differences of bytes, the even ones before the odd ones."""
    if len(packed) == size:
        return packed
    raw = bytearray(zlib.decompress(packed))
    for i in range(1, len(raw)):
        raw[i] = (raw[i - 1] + raw[i] - 128) & 255
    result, half = bytearray(size), (size + 1) // 2
    result[0::2], result[1::2] = raw[:half], raw[half:]
    return bytes(result)


def srgb(x):
    return 12.92 * x if x <= 0.0031308 else 1.055 * x ** (1 / 2.4) - 0.055


def png(width, height, samples):
    rows = b"".join(b"\0" + bytes(samples[3 * width * y:3 * width * (y + 1)]) for y in range(height))
    chunk = lambda kind, body: struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def tiff16(width, height, samples):
    body = struct.pack(f"<{len(samples)}H", *samples)
    at = 8 + len(body)
    tags = [(256, 3, 1, width), (257, 3, 1, height), (258, 3, 3, at), (259, 3, 1, 1), (262, 3, 1, 2), (273, 4, 1, 8),
            (277, 3, 1, 3), (278, 3, 1, height), (279, 4, 1, len(body))]
    return (struct.pack("<2sHI", b"II", 42, at + 6) + body + struct.pack("<3H", 16, 16, 16) + struct.pack("<H", len(tags))
            + b"".join(struct.pack("<HHII", *tag) for tag in tags) + struct.pack("<I", 0))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("image")
    parser.add_argument("photo")
    parser.add_argument("--exposure", type=float, default=1)
    parser.add_argument("--white-balance", default="1,1,1", help="R,G,B: factors of the channels")
    parser.add_argument("--electrons", type=float, default=20000, help="of a full well")
    parser.add_argument("--read-noise", type=float, default=5, help="electrons")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--linear16", action="store_true")
    options = parser.parse_args()
    balance = [float(b) for b in options.white_balance.split(",")]
    draw = random.Random(options.seed)
    width, height, rows = read_exr(options.image)
    samples = []
    for row in rows:
        for pixel in row:
            for value, factor in zip(pixel, balance):
                mean = max(0.0, value * factor * options.exposure) * options.electrons
                counted = mean + draw.gauss(0, (mean + options.read_noise ** 2) ** 0.5)
                light = min(1.0, max(0.0, counted / options.electrons))
                samples.append(round(65535 * light) if options.linear16 else round(255 * srgb(light)))
    with open(options.photo, "wb") as file:
        file.write(tiff16(width, height, samples) if options.linear16 else png(width, height, samples))
    full = 65535 if options.linear16 else 255
    print(f"{options.photo}: {width} x {height} pixels, {100 * samples.count(full) / len(samples):.2g} % of the samples saturated")


main()
