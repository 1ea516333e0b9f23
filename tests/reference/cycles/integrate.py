#!/usr/bin/env python3
"""Integrates the light of the plain square by the formulas of glTF's appendix B: integrate.py ROUGHNESS...

Camera, square and light are those of models.py; the world has radiance 0.1. Directions are a regular grid, so nothing is
noise. Prints the mean of the square by channel for three ways to weaken the diffuse part below the boundary:
  half     1 - F(V.H), the formula of the specification, without the light that facets send to others
  view     1 - E(V), E the albedo of the boundary: what Cycles does
  both     (1 - E(V)) (1 - E(L)) / (1 - mean of E): what Trisect does"""

import sys

import numpy as np

COLOUR = np.array([0.8, 0.7, 0.5])
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


def radiance(roughness):
    alpha = roughness**2
    n = 24
    grid = (np.arange(n) + 0.5) / n * 2 * SIDE - SIDE
    points = np.stack(np.meshgrid(grid, grid), -1).reshape(-1, 2)
    cosines, single = albedo_table(alpha, True)
    _, all_facets = albedo_table(alpha, False)
    # Light that facets lose comes out again as a lobe of Kulla and Conty.
    lost_mean = 1 - mean_of(cosines, all_facets)
    f_mean = F0 + (1 - F0) / 21
    back = f_mean**2 * (1 - lost_mean) / (1 - f_mean * lost_mean)
    lost = lambda c: 1 - np.interp(c, cosines, all_facets)
    e = lambda c: np.interp(c, cosines, single) + lost(c) * back
    e_mean = mean_of(cosines, single + (1 - all_facets) * back)
    corners = np.array([[-3, 1, 1], [-3, 3, 1], [-2, 3, 3], [-2, 1, 3]], float)
    a, b = corners[1] - corners[0], corners[3] - corners[0]
    m = 12
    s, t = np.meshgrid((np.arange(m) + 0.5) / m, (np.arange(m) + 0.5) / m)
    on_light = corners[0] + s.ravel()[:, None] * a + t.ravel()[:, None] * b
    area_normal = np.cross(a, b) / m**2
    world = hemisphere(120)
    total = np.zeros((3, 4))
    for x, y in points:
        p = np.array([x, y, 0.0])
        v = np.array([0, 0, 4.0]) - p
        v /= np.linalg.norm(v)
        to = on_light - p
        r2 = (to * to).sum(-1)
        l = to / np.sqrt(r2)[:, None]
        weight = 8 * abs(l @ area_normal) / r2 * l[:, 2]
        # The light hides the world: its part has radiance 8 instead of 0.1.
        hides = 0.1 * abs(l @ area_normal) / r2 * l[:, 2]
        for d, w in ((l, weight - hides), (world, np.full(len(world), 0.1 * np.pi / len(world)))):
            specular, f = facets(v, d, alpha)
            multiple = lost(v[2]) * lost(d[:, 2]) * back / (np.pi * lost_mean)
            ways = (1 - f, 1 - e(v[2]) + 0 * f, (1 - e(v[2])) * (1 - e(d[:, 2])) / (1 - e_mean))
            for way, factor in enumerate(ways):
                total[way, :3] += COLOUR / np.pi * (w * factor).sum()
                total[way, :3] += (w * (specular + (multiple if way else 0))).sum()
                total[way, 3] += (w * specular).sum()
    return total / len(points)


for roughness in map(float, sys.argv[1:]):
    for name, row in zip(("half", "view", "both"), radiance(roughness)):
        print(roughness, name, "square", row[:3].round(5), "of it specular", row[3].round(5))
