"""Renders a reference as NAME.a.npy and NAME.b.npy: H x W x 3 float32, top row first, from independent seeds.

    python3 render.py cornell_box.ron -o cornell_box --spp 2048
"""
import argparse
import os
import sys
import time

import numpy as np

parser = argparse.ArgumentParser()
parser.add_argument("scene")
parser.add_argument("-o", "--out", required=True)
parser.add_argument("--spp", type=int, default=1024, help="samples per pixel of each of the two images")
parser.add_argument("--chunk", type=int, default=32, help="samples per pixel in one launch")
parser.add_argument("--seed", type=int, default=0)
parser.add_argument("--variant", default="llvm_ad_rgb")
parser.add_argument("--threads", type=int, default=1)
parser.add_argument("--ggx", choices=["mitsuba", "separable", "correlated"], default="mitsuba",
                    help="rough metal and glass: Mitsuba's own (separable G), or those of bsdf.py")
args = parser.parse_args()

import mitsuba as mi

mi.set_variant(args.variant)
import drjit as dr

if args.variant.startswith("llvm"):
    dr.set_thread_count(args.threads)
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import bsdf
import convert

bsdf.register()
scene = convert.build(args.scene, None if args.ggx == "mitsuba" else args.ggx)
start = time.time()
for half, base in (("a", 1), ("b", 1_000_001)):
    total, count = 0.0, 0
    while count < args.spp:
        n = min(args.chunk, args.spp - count)
        total = total + np.array(mi.render(scene, spp=n, seed=base + 2_000_000 * args.seed + count), np.float64) * n
        count += n
    image = (total / count).astype(np.float32)
    assert np.isfinite(image).all()
    np.save(f"{args.out}.{half}.npy", image)
    print(f"{args.out}.{half}.npy {image.shape} mean {image.mean((0, 1))} {time.time() - start:.0f} s", flush=True)
