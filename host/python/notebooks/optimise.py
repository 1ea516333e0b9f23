# %% [markdown]
# # Find a parameter by finite differences
#
# Random numbers depend on the pixel, the sample and the seed alone. Two renders of one seed that
# differ in one parameter use the same numbers, so their difference has little noise: finite
# differences work with few samples.

# %%
import numpy as np

import trisect

scene = trisect.Scene.hello_world()
renderer = trisect.Renderer(scene, "cpu")


def render(scale, seed=0):
    renderer.update(scene.edit({"sky": f"Uniform(radiance: ({scale}, {scale}, {scale}))"}))
    return renderer.render(4, width=48, seed=seed).image


step = 1e-2
same = (render(1 + step) - render(1 - step)) / (2 * step)
other = (render(1 + step) - render(1 - step, seed=1)) / (2 * step)
ratio = other.std() / same.std()
print(f"with other random numbers the derivative has {ratio:.0f} times the deviation")

# %% [markdown]
# Newton's method for the radiance that gives a mean of 0.4:

# %%
scale = 1.0
for step_number in range(4):
    mean, slope = render(scale).mean(), (render(scale + step).mean() - render(scale - step).mean()) / (2 * step)
    scale -= (mean - 0.4) / slope
    print(f"radiance {scale:.6f}, mean {render(scale).mean():.6f}")
assert abs(render(scale).mean() - 0.4) < 1e-4
assert ratio > 3 and np.isfinite(same).all()
