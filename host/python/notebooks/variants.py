# %% [markdown]
# # Many variants of a scene
#
# A renderer for each thread, of one processor each; edits read no file again, and upload what
# differs.

# %%
import concurrent.futures
import os
import threading

import numpy as np

import trisect

scene = trisect.Scene.hello_world()
local = threading.local()


def render(variant):
    if not hasattr(local, "renderer"):
        local.renderer = trisect.Renderer(scene, "cpu", threads=1)
    red, green, blue = np.random.default_rng(variant).uniform(0, 1, 3)
    local.renderer.update(scene.edit({"sky": f"Uniform(radiance: ({red}, {green}, {blue}))"}))
    return local.renderer.render(4, width=32).image.mean(axis=(0, 1))


with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
    means = np.array(list(pool.map(render, range(200))))
print(means.shape, "variants, mean colour", means.mean(axis=0).round(2))
assert means.shape == (200, 3)
