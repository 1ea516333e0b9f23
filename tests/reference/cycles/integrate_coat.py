#!/usr/bin/env python3
"""Integrates the light of coat.gltf and specular_colour.gltf in the uniform world: integrate_coat.py FOLDER

Prints blocks of 8 x 8 pixels of the ball by row from below and column, by the formulas of glTF's appendix B and of the
extensions, and how far Cycles (images/) and Trisect (FOLDER, as compare.py renders them) are from that. The coat is mixed by its Fresnel term at the
viewer's angle (KHR_materials_clearcoat), the base weakened by 1 - F(V.H) with the greatest F of all channels
(KHR_materials_specular)."""

import os
import sys

import numpy as np
from integrate import CORNERS, ball, facets, hemisphere

HERE = os.path.dirname(os.path.abspath(__file__))
COLOUR = np.array([0.8, 0.7, 0.5])
BLOCKS = ((3, 3), (4, 2), (5, 2))


class Layers:
    """A dielectric of a roughness and reflectances, with a coat of a roughness or without."""

    def __init__(self, channel, roughness, f0, coat=None, side=48):
        self.colour, self.alpha, self.f0, self.greatest = COLOUR[channel], roughness**2, f0[channel], max(f0)
        self.coat = coat and coat**2
        a, b = CORNERS[1] - CORNERS[0], CORNERS[3] - CORNERS[0]
        grid = (np.arange(side) + 0.5) / side
        s, t = (x.ravel()[:, None] for x in np.meshgrid(grid, grid))
        self.places, self.area = CORNERS[0] + s * a + t * b, np.cross(a, b) / side**2
        self.world = hemisphere(90)

    def value(self, v, d):
        """Returns the value over the cosine, for directions in the frame of the normal."""
        h = v + d
        h /= np.linalg.norm(h, axis=-1, keepdims=True)
        grazing = (1 - (v * h).sum(-1)) ** 5
        f, greatest = (f0 + (1 - f0) * grazing for f0 in (self.f0, self.greatest))
        value = self.colour / np.pi * (1 - greatest) + f * facets(v, d, self.alpha, False)[0]
        if self.coat:
            share = 0.04 + 0.96 * (1 - v[2]) ** 5
            value = (1 - share) * value + share * facets(v, d, self.coat, False)[0]
        return value

    def red(self, point, normal, eye):
        """Returns the light of a point: of the lamp, which hides the world, and of the world."""
        across = np.cross(normal, [0.1, 1, 0.3])
        across /= np.linalg.norm(across)
        to_local = np.stack([across, np.cross(normal, across), normal])
        v = to_local @ ((eye - point) / np.linalg.norm(eye - point))
        to = self.places - point
        squares = (to * to).sum(1)
        to /= np.sqrt(squares)[:, None]
        l = to @ to_local.T
        seen = l[:, 2] > 1e-4
        weights = np.where(seen, 7.9 * abs(to @ self.area) / squares * l[:, 2], 0)
        lamp = (weights * self.value(v, np.where(seen[:, None], l, [0, 0, 1]))).sum()
        return lamp + 0.1 * np.pi * self.value(v, self.world).mean()


def image(path):
    with open(path, "rb") as file:
        file.readline()
        width, height = map(int, file.readline().split())
        file.readline()
        pixels = np.frombuffer(file.read(), "<f4").reshape(height, width, 3).astype(float)
    return pixels.reshape(8, height // 8, 8, width // 8, 3).mean((1, 3))


if __name__ == "__main__":
    models = (("coat", 0.5, [0.04] * 3, 0.2), ("specular_colour", 0.3, [0.04, 0.012, 0.004], None))
    for name, roughness, f0, coat in models:
        cycles, trisect = image(f"{HERE}/images/{name}.uniform.pfm"), image(f"{sys.argv[1]}/{name}.uniform.trisect.pfm")
        for block in BLOCKS:
            for channel, colour in enumerate(("red", "green", "blue")):
                text = ball(Layers(channel, roughness, f0, coat), *block).mean()
                shown = [(of[block][channel] / text - 1) * 100 for of in (cycles, trisect)]
                print(name, block, colour, f"text {text:.4f} Cycles {shown[0]:+.1f} % Trisect {shown[1]:+.1f} %")
