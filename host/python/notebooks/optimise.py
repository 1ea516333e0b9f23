# %% [markdown]
# # Find a parameter by finite differences
#
# Random numbers depend on the pixel, the sample and the seed alone. Two renders of one seed that differ in a parameter
# use the same numbers (common random numbers), so their difference has little noise.
#
# The target is an image of a ball whose redness we pretend not to know, with noise of its own.

# %%
import matplotlib.pyplot as plt
import numpy as np

import trisect

scene = trisect.Scene.hello_world()
renderer = trisect.Renderer(scene, "cpu")


def render(red, seed=0, spp=4):
    renderer.update(scene.edit({"materials.clay.albedo": (red, 0.25, 0.2)}))
    return renderer.render(spp, width=48, seed=seed).image


target = render(0.7, seed=99, spp=64)

# %% [markdown]
# ## The objective is smooth
#
# The mean squared distance from the target, by images of 4 samples per pixel. With common random numbers it is a
# smooth curve; with numbers of their own for each image, the noise hides the minimum.
# The roughness is the standard deviation of second differences.


# %%
def objective(red, seed):
    return np.mean(np.square(render(red, seed) - target, dtype=np.float64))


reds = np.linspace(0.4, 1, 61)
common = np.array([objective(red, seed=0) for red in reds])
independent = np.array([objective(red, seed=1 + number) for number, red in enumerate(reds)])
for name, curve in [("common", common), ("independent", independent)]:
    print(f"{name} random numbers: minimum at {reds[curve.argmin()]:.2f}, roughness {np.diff(curve, 2).std():.1e}")

# %% tags=["varies"]
figure, axes = plt.subplots(figsize=(6, 3))
axes.plot(reds, independent, ".-", color="tab:orange", label="independent random numbers")
axes.plot(reds, common, ".-", color="tab:blue", label="common random numbers")
axes.axvline(0.7, color="gray", linestyle=":", label="the target's value")
axes.set(xlabel="red of the ball's albedo", ylabel="mean squared distance")
axes.legend()
plt.show()

# %% [markdown]
# ## The derivative has little noise
#
# A central difference divides the noise by a small step, unless both images have the same noise.

# %%
step = 1e-2
same = (render(0.5 + step) - render(0.5 - step)) / (2 * step)
other = (render(0.5 + step) - render(0.5 - step, seed=1)) / (2 * step)
print(f"with independent random numbers the derivative has {other.std() / same.std():.0f} times the deviation")

# %% [markdown]
# ## Gauss-Newton
#
# Three renders of 4 samples per pixel a step. What remains is the noise of the images.

# %%
red = 0.4
for number in range(4):
    slope = (render(red + step) - render(red - step)) / (2 * step)
    red += float(np.sum(slope * (target - render(red))) / np.sum(slope**2))
    print(f"step {number + 1}: red {red:.4f}")
assert abs(red - 0.7) < 0.01
