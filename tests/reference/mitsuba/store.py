"""Stores a reference for the tests.

NAME.pfm is the mean of IMAGE.a.npy and IMAGE.b.npy. NAME.error.pfm is the standard error of the mean of each block of 8x8
pixels (those at the right and the bottom may be smaller), from the differences of the two.

    python3 store.py FOLDER NAME=IMAGE...      # FOLDER holds IMAGE.a.npy and IMAGE.b.npy
"""
import sys

import numpy as np

BLOCK = 8


def write(path, image):
    with open(path, "wb") as file:
        file.write(b"PF\n%d %d\n-1.0\n" % (image.shape[1], image.shape[0]) + image[::-1].astype("<f4").tobytes())


for argument in sys.argv[2:]:
    name, image = argument.split("=")
    a, b = (np.load(f"{sys.argv[1]}/{image}.{half}.npy").astype(np.float64) for half in "ab")
    mean, noise = (a + b) / 2, (a - b) ** 2 / 4
    h, w, _ = mean.shape
    rows, columns = range(0, h, BLOCK), range(0, w, BLOCK)
    error, level = (np.zeros((len(rows), len(columns), 3)) for _ in range(2))
    for i, y in enumerate(rows):
        for j, x in enumerate(columns):
            part = noise[y:y + BLOCK, x:x + BLOCK]
            error[i, j] = np.sqrt(part.sum((0, 1))) / (part.shape[0] * part.shape[1])
            level[i, j] = mean[y:y + BLOCK, x:x + BLOCK].mean((0, 1))
    # A block's noise is estimated from 64 differences. It is at least half the median share, so that a low estimate gives no
    # false alarm.
    share = np.median(error / np.maximum(level, 1e-12), axis=(0, 1))
    write(f"{name}.pfm", mean)
    write(f"{name}.error.pfm", np.maximum(error, share / 2 * level))
