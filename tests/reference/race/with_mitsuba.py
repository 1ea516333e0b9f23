"""Renders a scene by Mitsuba with as many samples as take the given time: see race.py.

    python3 with_mitsuba.py SCENE.ron SETTING --seconds 5 --seeds 2 --threads 2 --out FOLDER/NAME

The time is that of mi.render, after renders that compile it.
"""
import os
import sys
import time

import drjit as dr
import mitsuba as mi
import numpy as np

from worker import arguments, run

SETTINGS = {  # roulette from this depth, sampler
    "roulette 5": (5, "independent"),
    "roulette 5, multijitter": (5, "multijitter"),
    "no roulette": (10**6, "independent"),
}

args = arguments(SETTINGS)
mi.set_variant({"cpu": "llvm_ad_rgb", "cuda": "cuda_ad_rgb"}[args.device])
dr.set_thread_count(args.threads)
sys.path[1:1] = [os.path.join(os.path.dirname(os.path.abspath(__file__)), "../mitsuba")]
import convert
import ron

roulette, sampler = SETTINGS[args.setting]
world = convert.build(args.scene, sampler=sampler)
with open(args.scene) as file:
    scene = ron.parse(file.read())
tracer = {"type": "volpathmis" if "media" in scene else "path", "max_depth": int(scene["image"]["depth"])}
integrator = mi.load_dict({**tracer, "rr_depth": roulette})


def render(spp, seed):
    """Returns the image, its samples a pixel (some samplers round them up) and the seconds that it took."""
    dr.sync_thread()
    start = time.perf_counter()
    image = mi.render(world, integrator=integrator, spp=spp, seed=seed)
    dr.eval(image)
    dr.sync_thread()
    seconds = time.perf_counter() - start
    return np.array(image, np.float64), world.sensors()[0].sampler().sample_count(), seconds


run(args, render)
