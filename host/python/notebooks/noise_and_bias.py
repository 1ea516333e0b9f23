# %% [markdown]
# # Noise against bias
#
# Fewer segments per path are faster, and darken the image: a bias, which no number of samples removes.
# `evaluate` measures noise and bias apart.

# %%
import time

import trisect

scene = trisect.Scene.load("scenes/cornell_box.ron")
renderer = trisect.Renderer(scene, "cpu")


def images(**settings):
    found, seconds = [], []
    for seed in range(4):
        start = time.perf_counter()
        found.append(renderer.render(seed=seed, width=32, height=32, **settings))
        seconds.append(time.perf_counter() - start)
    return found, seconds


sets, times = {}, {}
for depth in [3, 5, 50]:
    sets[f"depth {depth}"], times[f"depth {depth}"] = images(spp=64, depth=depth)
reference, _ = images(spp=256)
rows = trisect.evaluate(sets, reference, seconds=times)["rows"]
for row in rows:
    noise, bias = (max(row["errors"][part]["value"], 0) ** 0.5 for part in ["variance", "squared_bias"])
    seen = "significant" if row["errors"]["biased"] else "not seen"
    print(f"{row['name']}: noise {100 * noise:.1f} %, bias {100 * bias:.1f} % ({seen})")

# %% [markdown]
# The times are of two CPU threads:

# %% tags=["varies"]
for row in rows:
    print(f"{row['name']}: {1e3 * row['seconds']['median']:.0f} ms")
