#!/usr/bin/env python3
"""Integrates the light of a plain dielectric by the formulas of glTF's appendix B: integrate.py ROUGHNESS...

Camera, light, square and ball are those of models.py; the world has radiance 0.1. Directions are a regular grid, so
nothing is noise. Prints the red of the whole square, and of blocks of 8 x 8 pixels of the ball by row from below and
column, for three ways to weaken the diffuse part below the boundary:
  half     1 - F(V.H), the formula of the specification, without the light that facets send to others
  view     1 - E(V), E the albedo of the boundary: what Cycles and Trisect do
  both     (1 - E(V)) (1 - E(L)) / (1 - mean of E), which is reciprocal"""

import math
import sys

import numpy as np

RED = 0.8
F0, SIDE = 0.04, 1.2


def schlick(cosine):
    return F0 + (1 - F0) * (1 - cosine) ** 5


def facets(v, l, alpha, fresnel=True):
    """Returns D G F / (4 V.N L.N) and F(V.H)."""
    h = v + l
    h /= np.linalg.norm(h, axis=-1, keepdims=True)
    a2 = alpha * alpha
    d = a2 / (np.pi * ((h[..., 2] ** 2) * (a2 - 1) + 1) ** 2)
    nv, nl = v[..., 2], l[..., 2]
    visible = 0.5 / (nl * np.sqrt(nv * nv * (1 - a2) + a2) + nv * np.sqrt(nl * nl * (1 - a2) + a2))
    f = schlick((v * h).sum(-1))
    return d * visible * (f if fresnel else 1), f


def hemisphere(n):
    """Returns directions with equal shares of the cosine-weighted hemisphere."""
    i, j = np.meshgrid(np.arange(n), np.arange(2 * n))
    r, phi = np.sqrt((i.ravel() + 0.5) / n), np.pi * (j.ravel() + 0.5) / n
    return np.stack([r * np.cos(phi), r * np.sin(phi), np.sqrt(1 - r * r)], -1)


def albedo_table(alpha, fresnel):
    cosines = (np.arange(64) + 0.5) / 64
    l = hemisphere(200)
    result = []
    for c in cosines:
        v = np.array([np.sqrt(1 - c * c), 0, c])
        result.append(np.pi * facets(v, l, alpha, fresnel)[0].mean())
    return cosines, np.array(result)


def mean_of(cosines, table):
    return 2 * (cosines * table).mean()


CORNERS = np.array([[-3, 1, 1], [-3, 3, 1], [-2, 3, 3], [-2, 1, 3]], float)
WAYS = ("half", "view", "both")


class Surface:
    """A dielectric of a roughness, in the light of the world and the quad."""

    def __init__(self, roughness):
        self.alpha = roughness**2
        self.cosines, self.single = albedo_table(self.alpha, True)
        _, self.facets = albedo_table(self.alpha, False)
        # Light that facets lose comes out again as a lobe of Kulla and Conty.
        self.lost_mean = 1 - mean_of(self.cosines, self.facets)
        f_mean = F0 + (1 - F0) / 21
        self.back = f_mean**2 * (1 - self.lost_mean) / (1 - f_mean * self.lost_mean)
        self.mean = mean_of(self.cosines, self.single + (1 - self.facets) * self.back)
        a, b = CORNERS[1] - CORNERS[0], CORNERS[3] - CORNERS[0]
        s, t = (x.ravel()[:, None] for x in np.meshgrid((np.arange(12) + 0.5) / 12, (np.arange(12) + 0.5) / 12))
        self.places, self.area = CORNERS[0] + s * a + t * b, np.cross(a, b) / 144
        self.world = hemisphere(60)

    def lost(self, cosine):
        return 1 - np.interp(cosine, self.cosines, self.facets)

    def albedo(self, cosine):
        return np.interp(cosine, self.cosines, self.single) + self.lost(cosine) * self.back

    def red(self, point, normal, eye):
        """Returns the red of a point by each way."""
        across = np.cross(normal, [0.1, 1, 0.3])
        across /= np.linalg.norm(across)
        to_local = np.stack([across, np.cross(normal, across), normal])
        v = to_local @ ((eye - point) / np.linalg.norm(eye - point))
        to = self.places - point
        squares = (to * to).sum(1)
        to /= np.sqrt(squares)[:, None]
        l = to @ to_local.T
        seen = l[:, 2] > 1e-4
        # The light hides the world: it adds 8 - 0.1.
        weights = np.where(seen, 7.9 * abs(to @ self.area) / squares * l[:, 2], 0)
        l = np.where(seen[:, None], l, [0, 0, 1])
        total = np.zeros(3)
        for d, w in ((l, weights), (self.world, np.full(len(self.world), 0.1 * np.pi / len(self.world)))):
            specular, f = facets(v, d, self.alpha)
            again = self.lost(v[2]) * self.lost(d[:, 2]) * self.back / (np.pi * self.lost_mean)
            entered = 1 - self.albedo(v[2])
            left = (1 - self.albedo(d[:, 2])) / (1 - self.mean)
            for way, factor in enumerate((1 - f, entered + 0 * f, entered * left)):
                total[way] += (w * (RED / np.pi * factor + specular + (again if way else 0))).sum()
        return total


def square(surface):
    grid = (np.arange(24) + 0.5) / 12 * SIDE - SIDE
    eye, up = np.array([0, 0, 4.0]), np.array([0, 0, 1.0])
    return np.mean([surface.red(np.array([x, y, 0]), up, eye) for x in grid for y in grid], 0)


def ball(surface, row, column):
    eye, total = np.array([0, 0, 4.0]), np.zeros(3)
    for pixel in range(64):
        x, y = column * 8 + pixel % 8 + 0.5, row * 8 + pixel // 8 + 0.5
        d = np.array([(x / 32 - 1) * math.tan(math.radians(20)), (y / 32 - 1) * math.tan(math.radians(20)), -1])
        d /= np.linalg.norm(d)
        inside = (d @ eye) ** 2 - 15
        if inside > 0:
            point = eye + d * (-(d @ eye) - math.sqrt(inside))
            total += surface.red(point, point / np.linalg.norm(point), eye)
        else:
            total += 0.1
    return total / 64


if __name__ == "__main__":
    for roughness in map(float, sys.argv[1:]):
        surface = Surface(roughness)
        print(f"roughness {roughness}", *WAYS)
        print("square", *square(surface).round(4))
        for block in ((3, 4), (2, 3), (4, 5), (3, 3), (2, 2), (5, 3), (4, 2)):
            print("ball", block, *ball(surface, *block).round(4))
