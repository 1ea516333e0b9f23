"""Renders scenes in Mitsuba's format with Mitsuba itself, and stores means of blocks of 8 x 8 pixels.

NAME.pfm has the mean of each block, NAME.error.pfm the standard error of that mean, from the scatter of independent parts.

    python3 render.py cornell_box [plates ...] [--spp 16384] [--parts 16] [--threads 1]
"""
import argparse

import numpy as np

parser = argparse.ArgumentParser()
parser.add_argument("names", nargs="+")
parser.add_argument("--spp", type=int, default=16384, help="samples per pixel of all parts together")
parser.add_argument("--parts", type=int, default=16)
parser.add_argument("--threads", type=int, default=1)
parser.add_argument("--variant", default="llvm_ad_rgb")
parser.add_argument("--out", default=".")
arguments = parser.parse_args()

import mitsuba as mi

mi.set_variant(arguments.variant)
import drjit as dr

if arguments.variant.startswith("llvm"):
    dr.set_thread_count(arguments.threads)
BLOCK = 8


def write(path, image):
    with open(path, "wb") as file:
        file.write(b"PF\n%d %d\n-1.0\n" % (image.shape[1], image.shape[0]) + image[::-1].astype("<f4").tobytes())


for name in arguments.names:
    scene = mi.load_file(f"{name}.xml")
    parts = []
    for part in range(arguments.parts):
        chunk, count, total = 256, arguments.spp // arguments.parts, 0.0
        for start in range(0, count, chunk):
            n = min(chunk, count - start)
            total = total + np.array(mi.render(scene, spp=n, seed=1_000_000 * part + start + 1), np.float64) * n
        image = total / count
        height, width, _ = image.shape
        assert height % BLOCK == 0 and width % BLOCK == 0 and np.isfinite(image).all()
        parts.append(image.reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK, -1)[..., :3].mean((1, 3)))
    parts = np.stack(parts)
    write(f"{arguments.out}/{name}.pfm", parts.mean(0))
    write(f"{arguments.out}/{name}.error.pfm", parts.std(0, ddof=1) / np.sqrt(len(parts)))
    print(name, parts.mean((0, 1, 2)), flush=True)
