#!/usr/bin/env python3
"""Computes how a white metal of roughness 1 looks in panorama.pfm (models.py) in three ways: rough_metal.py

It is a point of a square that is turned by 45 degrees about x, seen from 2.6 above its middle along -z, as in Khronos'
sample model Cameras. Prints the radiance by random walks on the microsurface, by Kulla and Conty's additional lobe
(Trisect), and by a lobe that is scaled to reflect all light (Cycles). Needs numpy."""

import os

import numpy as np

source = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../microsurface/walk.py")
with open(source) as file:
    exec(file.read().replace("\nmain()\n", "\n"))

def panorama(path):
    with open(path, "rb") as file:
        file.readline()
        width, height = map(int, file.readline().split())
        file.readline()
        return np.frombuffer(file.read(), "<f4").reshape(height, width, 3).astype(float)

def sky(pixels, d):
    """Returns the radiance from directions, bilinearly."""
    height, width, _ = pixels.shape
    row = (1 - np.arccos(np.clip(d[1], -1, 1)) / np.pi) * height - 0.5
    column = (np.arctan2(d[0], -d[2]) / (2 * np.pi) + 0.5) * width - 0.5
    r, c = np.floor(row).astype(int), np.floor(column).astype(int)
    s, t = (row - r)[:, None], (column - c)[:, None]
    at = lambda r, c: pixels[np.clip(r, 0, height - 1), c % width]
    return (at(r, c) * (1 - t) + at(r, c + 1) * t) * (1 - s) + (at(r + 1, c) * (1 - t) + at(r + 1, c + 1) * t) * s

pixels = panorama("panorama.pfm")
normal, view = np.array([0, 0.7068, 0.7074]), np.array([0, 0.0551, 0.9985])
cosine = view @ normal
across = view - cosine * normal
across /= np.linalg.norm(across)
world = lambda d: np.outer(across, d[0]) + np.outer(np.cross(normal, across), d[1]) + np.outer(normal, d[2])
light = sky(pixels, world(walks(cosine, 1.0)[0]))
print("walk", light.mean(0).round(4), "+-", (light.std(0) / len(light) ** 0.5).round(4))

heights, angles = np.meshgrid((np.arange(300) + 0.5) / 300, (np.arange(600) + 0.5) / 300 * np.pi, indexing="ij")
sines = np.sqrt(1 - heights**2)
i = np.stack([sines * np.cos(angles), sines * np.sin(angles), heights]).reshape(3, -1)
angle = 2 * np.pi / heights.size
viewer = lambda cos: np.array([np.sqrt(1 - cos * cos), 0, cos])
cosines = (np.arange(40) + 0.5) / 40
albedos = np.array([once(viewer(c), i, 1.0).sum() * angle for c in cosines])
mean_lost = 1 - 2 * (albedos * cosines).mean()
single = once(viewer(cosine), i, 1.0)
albedo = single.sum() * angle
again = (1 - albedo) * (1 - np.interp(i[2], cosines, albedos)) / (np.pi * mean_lost) * i[2]
for name, lobe in (("Kulla and Conty", single + again), ("scaled", single / albedo)):
    print(name, ((lobe * angle) @ sky(pixels, world(i))).round(4))
