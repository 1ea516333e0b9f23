# %% [markdown]
# # Noise against bias
#
# Fewer segments per path are faster, and darken the image: a bias, which no number of samples
# removes. `evaluate` tells it from noise.

# %%
import time

import trisect

scene = trisect.Scene.load("scenes/cornell_box.ron")
renderer = trisect.Renderer(scene, "cpu")
size = dict(width=48, height=48)


def images(**settings):
    found, seconds = [], []
    for seed in range(4):
        start = time.perf_counter()
        found.append(renderer.render(seed=seed, **size, **settings))
        seconds.append(time.perf_counter() - start)
    return found, seconds


sets, times = {}, {}
for depth in [3, 6, 50]:
    sets[f"depth {depth}"], times[f"depth {depth}"] = images(spp=64, depth=depth)
reference, _ = images(spp=1024)
for row in trisect.evaluate(sets, [one.image for one in reference], seconds=times)["rows"]:
    errors = row["errors"]
    print(
        f"{row['name']}: noise {100 * errors['variance']['value'] ** 0.5:.1f} %, "
        f"bias {100 * max(errors['squared_bias']['value'], 0) ** 0.5:.1f} %"
        f"{' (significant)' if errors['biased'] else ''}, {1e3 * row['seconds']['median']:.0f} ms"
    )
