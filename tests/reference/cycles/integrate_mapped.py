#!/usr/bin/env python3
"""Integrates the light of ball_stretched.gltf and ball.gltf in the uniform world: integrate_mapped.py FOLDER

The normal map is that of models.py, read with its 8 bits and its filter. Its normal is taken in two spaces: in the
world, by the transformed normal, tangent and bitangent, and in the mesh, whose result is transformed. The diffuse part
below the boundary is weakened in three ways: half, 1 - F(V.H), and 1 - E(V) by the angle to the map's normal and to
the normal that is bent so that no mirrored ray enters the surface. It is weakened by the bump's shadow, too (Conty
Estevez and others, 2019), which both renderers have. Prints the red of blocks of 8 x 8 pixels that the ball fills, by row from below and
column, with those of Cycles (images/) and of Trisect (FOLDER, as compare.py renders them), and how far these are from
each of the integrals."""

import math
import os
import sys

import numpy as np
from integrate import RED, Surface, facets

HERE = os.path.dirname(os.path.abspath(__file__))
EYE = np.array([0, 0, 4.0])
BLOCKS = [(row, column) for row in (2, 3, 4, 5) for column in (2, 3, 4, 5) if (row, column) != (4, 5)]
WAVES, SIZE, SLOPE = 6, 64, 0.6


def unit(vector):
    return vector / np.linalg.norm(vector)


def texels():
    place = (np.arange(SIZE) + 0.5) / SIZE
    x, y = SLOPE * np.sin(2 * np.pi * WAVES * place)[None, :], SLOPE * np.cos(2 * np.pi * WAVES * place)[:, None]
    length = np.sqrt(x * x + y * y + 1)
    return np.stack([np.round((c / length * 0.5 + 0.5) * 255) / 255 for c in (x, y, 1)], -1)


TEXELS = texels()


def mapped(u, v):
    x, y = u * SIZE - 0.5, v * SIZE - 0.5
    i, j = math.floor(x), math.floor(y)
    a, b = x - i, y - j
    at = lambda i, j: TEXELS[j % SIZE, i % SIZE]
    mixed = (at(i, j) * (1 - a) + at(i + 1, j) * a) * (1 - b) + (at(i, j + 1) * (1 - a) + at(i + 1, j + 1) * a) * b
    return mixed * 2 - 1


def normals(point, scale):
    """Returns the ellipsoid's normal, and the map's in the world and in the mesh."""
    q = point / scale
    polar, around = math.acos(max(-1, min(1, q[1]))), math.atan2(-q[2], q[0]) % (2 * math.pi)
    c = mapped(around / math.pi, polar / math.pi)
    along = np.array([-math.sin(around), 0, -math.cos(around)])
    in_mesh = unit(along * c[0] + np.cross(q, along) * c[1] + q * c[2])
    normal, tangent = unit(q / scale), unit(along * scale)
    bitangent = np.cross(normal, tangent) * np.sign(np.prod(scale))
    return normal, unit(tangent * c[0] + bitangent * c[1] + normal * c[2]), unit(in_mesh / scale)


def bent(normal, smooth, viewer):
    """Returns the normal, bent where the viewer's mirror image would be below 0.6 degrees."""
    facing, up = 2 * (normal @ viewer), viewer @ smooth
    lift = min(0.9 * up, 0.01) + up - facing * (normal @ smooth)
    return unit(normal * facing + smooth * lift) if lift > 0 else normal


def red(surface, point, smooth, normal):
    """Returns the red of a point by each way."""
    across = unit(np.cross(normal, [0.1, 1, 0.3]))
    to_local = np.stack([across, np.cross(normal, across), normal])
    viewer = unit(EYE - point)
    v, up = to_local @ viewer, to_local @ smooth
    v[2] = max(v[2], 1e-3)
    to = surface.places - point
    squares = (to * to).sum(1)
    to /= np.sqrt(squares)[:, None]
    l = to @ to_local.T
    seen = (l[:, 2] > 1e-4) & (l @ up > 0)
    weights = np.where(seen, 7.9 * abs(to @ surface.area) / squares * l[:, 2], 0)
    l = np.where(seen[:, None], l, [0, 0, 1])
    count = len(surface.world)
    of_world = np.where(surface.world @ up > 0, 0.1 * np.pi / count, 0)
    steepness = min(0.125 * (1 / max(normal @ smooth, 1e-3) ** 2 - 1), 1)
    total = np.zeros(3)
    for d, w in ((l, weights), (surface.world, of_world)):
        specular, f = facets(v, d, surface.alpha)
        again = surface.lost(v[2]) * surface.lost(d[:, 2]) * surface.back / (np.pi * surface.lost_mean)
        shadow = 2 / (1 + np.sqrt(1 + steepness * np.maximum(1 / np.maximum(d @ up, 1e-3) ** 2 - 1, 0)))
        of_map, of_bent = (1 - surface.albedo(c) + 0 * f for c in (v[2], bent(normal, smooth, viewer) @ viewer))
        for way, factor in enumerate((1 - f, of_map, of_bent)):
            total[way] += (w * (RED / np.pi * factor * shadow + specular + (again if way else 0))).sum()
    return total


def block(surface, row, column, scale, side=12):
    """Returns the red of a block: rows for the world and the mesh, columns for the ways."""
    total = np.zeros((2, 3))
    for sample in range(side * side):
        x, y = column * 8 + (sample % side + 0.5) * 8 / side, row * 8 + (sample // side + 0.5) * 8 / side
        half = math.tan(math.radians(20))
        d = unit(np.array([(x / 32 - 1) * half, (y / 32 - 1) * half, -1]))
        o, e = EYE / scale, d / scale
        a, b, c = e @ e, o @ e, o @ o - 1
        point = EYE + d * ((-b - math.sqrt(b * b - a * c)) / a)
        smooth, *both = normals(point, scale)
        total += [red(surface, point, smooth, normal) for normal in both]
    return total / side**2


def image(path):
    with open(path, "rb") as file:
        file.readline()
        width, height = map(int, file.readline().split())
        file.readline()
        pixels = np.frombuffer(file.read(), "<f4").reshape(height, width, 3).astype(float)
    return pixels.reshape(8, height // 8, 8, width // 8, 3).mean((1, 3))[:, :, 0]


if __name__ == "__main__":
    surface = Surface(0.5)
    for name, scale in (("ball_stretched", [1, -1.2, 0.8]), ("ball", [1, 1, 1])):
        shown = [image(f"{HERE}/images/{name}.uniform.pfm"), image(f"{sys.argv[1]}/{name}.uniform.trisect.pfm")]
        print(name, "| world: half, map, bent | mesh: half, map, bent | Cycles | Trisect")
        rows = []
        for row, column in BLOCKS:
            integrals = block(surface, row, column, np.array(scale, float))
            rows.append([*integrals.ravel(), *(of[row, column] for of in shown)])
            print((row, column), *(f"{x:.4f}" for x in rows[-1]), flush=True)
        rows = np.array(rows)
        for program, column in (("Cycles", 6), ("Trisect", 7)):
            off = np.sqrt(((rows[:, column : column + 1] / rows[:, :6] - 1) ** 2).mean(0))
            print(f"{program}, root mean square from each integral:", *(f"{x:.4f}" for x in off))
