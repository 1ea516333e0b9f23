"""Writes the meshes, images and the panorama of the scenes in this folder. Needs NumPy only."""
import math
import struct
import zlib

import numpy as np


def png(path, image):
    """Writes 8-bit RGB."""
    height, width, _ = image.shape
    rows = b"".join(b"\0" + row.tobytes() for row in image.astype(np.uint8))
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


def smooth_image(width, height):
    """Slow waves that tell left from right and top from bottom."""
    y, x = np.mgrid[0:height, 0:width]
    u, v = (x + 0.5) / width * 2 * math.pi, (y + 0.5) / height * 2 * math.pi
    channels = [0.5 + 0.4 * np.sin(u), 0.5 + 0.4 * np.sin(v + 1), 0.5 + 0.3 * np.sin(u + v + 2)]
    return np.round(np.stack(channels, -1) * 255)


def mask(size):
    """A disc with a soft border beside the middle."""
    y, x = np.mgrid[0:size, 0:size]
    distance = np.hypot((x + 0.5) / size - 0.42, (y + 0.5) / size - 0.4)
    alpha = np.clip((0.36 - distance) / 0.1, 0, 1)
    return np.repeat(np.round(alpha * 255)[:, :, None], 3, 2)


def torus(path, across=48, around=24):
    """PLY without normals: a ring of radius 1 and thickness 0.4 about z, with texture coordinates."""
    vertices, faces = [], []
    for i in range(across + 1):
        for j in range(around + 1):
            a, b = 2 * math.pi * i / across, 2 * math.pi * j / around
            r = 1 + 0.4 * math.cos(b)
            vertices.append((r * math.cos(a), r * math.sin(a), 0.4 * math.sin(b), i / across, j / around))
    for i in range(across):
        for j in range(around):
            p = i * (around + 1) + j
            q = p + around + 1
            faces += [(p, q, q + 1), (p, q + 1, p + 1)]
    with open(path, "wb") as file:
        header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
        header += [f"property float {name}" for name in ("x", "y", "z", "u", "v")]
        header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header", ""]
        file.write("\n".join(header).encode())
        file.write(np.array(vertices, "<f4").tobytes())
        file.write(b"".join(struct.pack("<B3i", 3, *face) for face in faces))


PYRAMID = """# A pyramid with an image on each side.
v -0.5 0 0.5
v 0.5 0 0.5
v 0.5 0 -0.5
v -0.5 0 -0.5
v 0 0.9 0
vt 0 0
vt 1 0
vt 0.5 1
f 1/1 2/2 5/3
f 2/1 3/2 5/3
f 3/1 4/2 5/3
f 4/1 1/2 5/3
"""


def sky(path, width=64, height=32):
    """A smooth panorama, brightest at one side above the horizon."""
    y, x = np.mgrid[0:height, 0:width]
    v, u = y / (height - 1) * math.pi, (x + 0.5) / width * 2 * math.pi
    toward = np.sin(v) * np.cos(u - 1) * 0.8 + np.cos(v) * 0.6
    glow = np.exp(4 * (toward - 1))
    channels = [0.3 + 3 * glow, 0.4 + 2.6 * glow, 0.6 + 2 * glow + 0.2 * np.cos(v)]
    image = np.stack(channels, -1).astype("<f4")
    with open(path, "wb") as file:
        file.write(b"PF\n%d %d\n-1.0\n" % (width, height) + image[::-1].tobytes())


png("tiles.png", smooth_image(32, 32))
png("mask.png", mask(32))
torus("torus.ply")
sky("sky.pfm")
with open("pyramid.obj", "w") as file:
    file.write(PYRAMID)
