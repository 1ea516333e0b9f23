#!/usr/bin/env python3
"""Compares two models of multiple scattering by GGX facets with random walks on the microsurface.

The walk is that of Heitz, Hanika, d'Eon and Dachsbacher, "Multiple-Scattering Microfacet BSDFs with the Smith
Model", 2016: facets that reflect all light, heights that are uniform. Prints for each roughness and cosine of
the viewer the share of light that leaves at the first reflection, and the sum of the differences of 24 solid
angles, by Kulla and Conty (2017) and by a lobe that is scaled to reflect all light (Turquin, 2019).

Needs numpy."""

import numpy as np

RANDOM = np.random.default_rng(1)
PARTS, BINS = 60, (6, 4)


def masked(w, alpha):
    """Returns Smith's lambda for directions on both sides."""
    z = np.clip(w[2], -0.99999, 0.99999)
    slope = z / (alpha * np.sqrt(1 - z * z) + 1e-12)
    return 0.5 * (np.sign(slope) * np.sqrt(1 + 1 / (slope * slope + 1e-20)) - 1)


def visible_normals(v, alpha):
    count = v.shape[1]
    stretched = np.stack([v[0] * alpha, v[1] * alpha, v[2]])
    stretched /= np.linalg.norm(stretched, axis=0)
    around = 2 * np.pi * RANDOM.random(count)
    z = (1 - RANDOM.random(count)) * (1 + stretched[2]) - stretched[2]
    radius = np.sqrt(np.maximum(1 - z * z, 0))
    cap = np.stack([radius * np.cos(around), radius * np.sin(around), z]) + stretched
    normals = np.stack([cap[0] * alpha, cap[1] * alpha, np.maximum(cap[2], 1e-9)])
    return normals / np.linalg.norm(normals, axis=0)


def walks(cos, alpha, count=400_000, most=30):
    """Returns the directions in which light leaves, and the number of its reflections."""
    w = np.tile(np.array([[-np.sqrt(1 - cos * cos)], [0], [-cos]]), (1, count))
    height = np.ones(count)
    left, orders = [], []
    for order in range(most):
        if w.shape[1] == 0:
            break
        below = np.clip(0.5 * (height + 1), 0, 1)
        slopes, choice = masked(w, alpha), RANDOM.random(w.shape[1])
        seen = np.power(np.maximum(below, 1e-30), np.where(slopes > 0, slopes, 0))
        leaves = (w[2] > 0) & (choice > 1 - seen)
        with np.errstate(all="ignore"):
            next_below = below / np.power(1 - choice, 1 / slopes)
        height = np.clip(2 * np.clip(next_below, 0, 1) - 1, -1, 1)
        height = np.where(w[2] < -0.9999, 2 * choice * below - 1, height)
        left.append(w[:, leaves])
        orders.append(np.full(leaves.sum(), order))
        w, height = w[:, ~leaves], height[~leaves]
        normal = visible_normals(-w, alpha)
        w = w - 2 * (w * normal).sum(0) * normal
        w /= np.linalg.norm(w, axis=0)
    return np.concatenate(left, 1), np.concatenate(orders)


def once(o, i, alpha):
    """Returns value times cosine of single scattering."""
    smith = lambda z: 0.5 * (np.sqrt(1 + alpha**2 * np.maximum(1 - z * z, 0) / (z * z)) - 1)
    h = o[:, None] + i
    h /= np.linalg.norm(h, axis=0)
    s = h[0] ** 2 + h[1] ** 2 + alpha**2 * h[2] ** 2
    return alpha**2 / (np.pi * s * s) / (1 + smith(o[2]) + smith(i[2])) / (4 * o[2])


def main():
    z, around = ((np.arange(n * PARTS) + 0.5) / (n * PARTS) for n in BINS)
    heights, angles = np.meshgrid(z, around * np.pi, indexing="ij")
    sines = np.sqrt(1 - heights**2)
    i = np.stack([sines * np.cos(angles), sines * np.sin(angles), heights]).reshape(3, -1)
    angle = 2 * np.pi / (heights.size)
    viewer = lambda cos: np.array([np.sqrt(1 - cos * cos), 0, cos])
    for roughness in (0.6, 1.0):
        alpha = roughness**2
        albedos = np.interp(z, z[::10], [once(viewer(c), i, alpha).sum() * angle for c in z[::10]])
        mean_lost = 1 - 2 * (albedos * z).mean()
        for cos in (1.0, 0.6, 0.25):
            w, orders = walks(cos, alpha)
            bins = (np.minimum((w[2] * 6).astype(int), 5), np.minimum((np.arctan2(np.abs(w[1]), w[0]) / np.pi * 4).astype(int), 3))
            walked = np.zeros(BINS)
            np.add.at(walked, bins, 1 / w.shape[1])
            single = once(viewer(cos), i, alpha).reshape(heights.shape)
            albedo = single.sum() * angle
            again = (1 - albedo) * (1 - albedos)[:, None] / (np.pi * mean_lost) * heights
            apart = []
            for model in (single + again, single / albedo):
                shares = (model * angle).reshape(BINS[0], PARTS, BINS[1], PARTS).sum((1, 3))
                apart.append(np.abs(shares - walked).sum())
            first = (orders == 1).mean()
            print(f"roughness {roughness}, cosine {cos}: {first:.3f} at once; apart {apart[0]:.3f} and {apart[1]:.3f}")


main()
