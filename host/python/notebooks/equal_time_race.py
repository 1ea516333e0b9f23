# %% [markdown]
# # Equal-time race with Mitsuba 3
#
# Which renderer has less noise after the same time? Both read the same file, a box of diffuse walls, and render it
# with paths of at most 8 segments on the same CPU threads, one program after the other. Mitsuba is 3.9.1
# (`pip install mitsuba==3.9.1`) with its variant for CPUs that is fastest, `llvm_ad_rgb`.

# %% tags=["parameters"]
seconds = 1.0
seeds = 8

# %%
import functools
import os
import time

import drjit as dr
import matplotlib.pyplot as plt
import mitsuba as mi
import numpy as np

import trisect

path = "tests/reference/mitsuba/xml/cornell_box.xml"
threads = os.cpu_count()
size = dict(width=128, height=96)

# %% [markdown]
# Mitsuba renders with independent and with multijittered samples, with Russian roulette from its usual depth 5 on.
# The film's filter is a box, as Trisect's is. The first render, which compiles the kernel, is not timed.

# %%
mi.set_variant("llvm_ad_rgb")
dr.set_thread_count(threads)
mi.set_log_level(mi.LogLevel.Error)  # a multijittered number of samples is rounded up
with open(path) as file:
    text = file.read()


def mitsuba_with(sampler):
    text_of_sampler = text.replace('sampler type="independent"', f'sampler type="{sampler}"')
    world = mi.load_string(text_of_sampler.replace('name="height" value="48"', 'name="height" value="96"'), res=128)
    integrator = mi.load_dict({"type": "path", "max_depth": 8, "rr_depth": 5})

    def render(spp, seed):
        image = mi.render(world, integrator=integrator, spp=spp, seed=seed)
        dr.eval(image)
        dr.sync_thread()
        return np.array(image, np.float32)

    return render


# %% [markdown]
# Trisect renders with its defaults, once with a number of samples and once to the time.

# %%
renderer = trisect.Renderer(trisect.Scene.load(path), "cpu", threads=threads)


def trisect_samples(spp, seed):
    return renderer.render(spp, seed=seed, **size).image


def trisect_budget(seed):
    return renderer.render(budget=seconds, denoise="off", seed=seed, **size).image


# %% [markdown]
# Each racer renders `seeds` images, in turn with the others, of as many samples as take the time.

# %%


def timed(render, *arguments):
    start = time.perf_counter()
    image = render(*arguments)
    return image, time.perf_counter() - start


def samples_for(render):
    """Returns the samples per pixel that take about `seconds`."""
    render(4, 0)
    spp, took = 4, timed(render, 4, 0)[1]
    while took < 0.7 * seconds:
        spp = max(spp + 1, int(spp * min(seconds / took, 4)))
        took = min(timed(render, spp, seed)[1] for seed in range(2))
    return max(1, round(spp * seconds / took))


racers = {}
for name, render in [
    ("Mitsuba, independent", mitsuba_with("independent")),
    ("Mitsuba, multijitter", mitsuba_with("multijitter")),
    ("Trisect, samples", trisect_samples),
]:
    racers[name] = functools.partial(render, samples_for(render))
racers["Trisect, budget"] = trisect_budget

sets, times = {name: [] for name in racers}, {name: [] for name in racers}
for seed in range(seeds):
    for name, render in racers.items():
        image, took = timed(render, seed)
        sets[name].append(image)
        times[name].append(took)

# %% [markdown]
# `evaluate` scales the noise to exactly one second by the median time. The reference is Trisect's, with other seeds:
# the bias of Mitsuba's images tells whether both compute the same image.

# %% tags=["varies"]
reference = [renderer.render(budget=2 * seconds, denoise="off", seed=900 + seed, **size) for seed in range(4)]
rows = trisect.evaluate(sets, reference, seconds=times)["rows"]
print(f"{threads} CPU threads, {size['width']} x {size['height']} pixels, {seeds} images each")
for row in rows:
    noise, bias = row["noise_at_one_second"], max(row["errors"]["squared_bias"]["value"], 0) ** 0.5
    value, low, high = (100 * noise[end] for end in ("value", "low", "high"))
    print(
        f"{row['name']}: {row['seconds']['median']:.2f} s, noise at one second {value:.2f} % ({low:.2f} to {high:.2f}), "
        f"bias {100 * bias:.2f} %, p {row['errors']['bias_p']:.2f}"
    )

# %% [markdown]
# The intervals are of 95 %. A p below 0.01 would mean that the images differ from the reference by more than noise.
# Other scenes give other results: [eight of them](../../../docs/notebook/equal-time.md), by three renderers.

# %% tags=["varies"]
figure, axes = plt.subplots(figsize=(6, 1.8))
noise = [row["noise_at_one_second"] for row in rows]
values = [100 * each["value"] for each in noise]
errors = [[100 * abs(each[end] - each["value"]) for each in noise] for end in ("low", "high")]
axes.barh([row["name"] for row in rows], values, xerr=errors, color=["tab:gray"] * 2 + ["tab:blue"] * 2, capsize=3)
axes.invert_yaxis()
axes.set(xlabel="noise at one second, %")
plt.show()
