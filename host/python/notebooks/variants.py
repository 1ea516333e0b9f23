# %% [markdown]
# # Ten thousand variants of a scene
#
# A renderer with one thread for each processor. Edits read no file again, and an update keeps what is the same on the
# device: here the BVH. Python's lock is released while a renderer works.

# %% tags=["parameters"]
count = 10_000

# %%
import concurrent.futures
import os
import threading
import time

import matplotlib.pyplot as plt
import numpy as np

import trisect

scene = trisect.Scene.hello_world()
local = threading.local()


def variant(number):
    """Returns an image under a sky and with a ball of random colours, and the colours."""
    if not hasattr(local, "renderer"):
        local.renderer = trisect.Renderer(scene, "cpu", threads=1)
    sky, ball = np.random.default_rng(number).uniform(0, 1, (2, 3)).round(4)
    fields = {"sky": f"Uniform(radiance: {tuple(sky.tolist())})", "materials.clay.albedo": ball.tolist()}
    local.renderer.update(scene.edit(fields))
    return local.renderer.render(16, width=32, height=18).image, [sky, ball]


# %% tags=["varies"]
start = time.perf_counter()
with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
    images, colours = zip(*pool.map(variant, range(count)))
seconds = time.perf_counter() - start
images, colours = np.array(images), np.array(colours)
print(f"{count} variants on {os.cpu_count()} threads in {seconds:.1f} s: {count / seconds:.0f} per second")
print("images", images.shape, images.dtype, "colours", colours.shape)

# %% [markdown]
# The first 60 of them:

# %%
tiles = images[:60].reshape(6, 10, 18, 32, 3).swapaxes(1, 2).reshape(6 * 18, 10 * 32, 3)
print("mean radiance", tiles.mean(axis=(0, 1)).round(3))

# %% tags=["varies"]
figure = plt.figure(figsize=(6.4, 2.16))
figure.add_axes((0, 0, 1, 1)).set_axis_off()
figure.axes[0].imshow(np.clip(tiles, 0, 1) ** (1 / 2.2))
plt.show()
