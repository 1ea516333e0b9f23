#!/usr/bin/env python3
"""Writes the small files that the picture scenes name: three images and a torus.

The bytes are the same each time. Standard library only. sky.hdr is that of scenes/textures.
"""

import math
import pathlib
import struct
import zlib

HERE = pathlib.Path(__file__).parent


def png(name, width, height, texel, channels=3):
    """Writes a PNG file; `texel(x, y)` returns the channels, 0 to 255."""
    rows = b"".join(
        b"\0" + bytes(c for x in range(width) for c in texel(x, y)) for y in range(height)
    )

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 6 if channels == 4 else 2, 0, 0, 0)
    body = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")
    (HERE / name).write_bytes(b"\x89PNG\r\n\x1a\n" + body)


def checker(x, y):
    return (150, 150, 146) if (x + y) % 2 else (226, 224, 218)


LETTER = [
    "................",
    "................",
    "....########....",
    "....########....",
    "....##..........",
    "....##..........",
    "....##..........",
    "....######......",
    "....######......",
    "....##..........",
    "....##..........",
    "....##..........",
    "....##..........",
    "....##..........",
    "................",
    "................",
]


def letter(x, y):
    """An F, red at the left border, blue at the top border: it shows which way an image lies."""
    if LETTER[y][x] == "#":
        return (40, 40, 44)
    if y == 0:
        return (50, 90, 200)
    if x == 0:
        return (200, 60, 40)
    return (235, 225, 190)


def leaf(x, y):
    """A disc that fades out from its middle to its border, by its alpha."""
    r = math.hypot(x - 31.5, y - 31.5) / 31.5
    return (70, 150, 60, max(0, min(255, round(255 * (1.25 - 1.25 * r)))))


def rings(x, y):
    """Green is roughness: narrow bands of 0.2 and 0.7. Blue is metallic: all."""
    return (255, 50 if y % 2 else 180, 255)


def torus(name, big=1.0, small=0.4, around=32, across=14):
    """Writes a torus with smooth normals, around +y, on y = 0, and its material."""
    lines = ["# A torus around +y, made by files.py.", "mtllib torus.mtl", "usemtl clay"]
    points, normals, faces = [], [], []
    for i in range(around):
        for j in range(across):
            a, b = 2 * math.pi * i / around, 2 * math.pi * j / across
            n = (math.cos(b) * math.cos(a), math.sin(b), math.cos(b) * math.sin(a))
            p = (big * math.cos(a) + small * n[0], small + small * n[1], big * math.sin(a) + small * n[2])
            points.append("v %.4f %.4f %.4f" % p)
            normals.append("vn %.3f %.3f %.3f" % n)
            corner = lambda k, l: 1 + (k % around) * across + l % across
            quad = [corner(i, j), corner(i, j + 1), corner(i + 1, j + 1), corner(i + 1, j)]
            faces.append("f " + " ".join(f"{k}//{k}" for k in quad))
    (HERE / name).write_text("\n".join(lines + points + normals + faces) + "\n")


png("checker.png", 2, 2, checker)
png("letter.png", 16, 16, letter)
png("leaf.png", 64, 64, leaf, 4)
png("rings.png", 1, 8, rings)
torus("torus.obj")
(HERE / "torus.mtl").write_text("# Glossy clay.\nnewmtl clay\nKd 0.70 0.36 0.24\nPr 0.3\n")
