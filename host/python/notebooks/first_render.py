# %% [markdown]
# # First render
#
# A scene of parts, a render, and its layers.

# %%
import numpy as np

import trisect

scene = trisect.Scene(
    camera=trisect.Camera(look_from=(0, 1.2, 4), look_at=(0, 0.5, 0), vertical_fov=35),
    materials={
        "floor": trisect.Lambertian((0.6, 0.6, 0.6)),
        "glass": trisect.Dielectric(1.5),
        "gold": trisect.Conductor(trisect.Schlick((1.0, 0.78, 0.34)), roughness=0.15),
    },
    objects=[
        trisect.Plane((0, 0, 0), (0, 1, 0), "floor", name="floor"),
        trisect.Sphere((-0.6, 0.5, 0), 0.5, "glass", name="glass ball"),
        trisect.Sphere((0.6, 0.5, 0), 0.5, "gold", name="gold ball"),
    ],
    sky=trisect.Gradient((1, 1, 1), (0.5, 0.7, 1)),
    width=192,
    height=108,
)
renderer = trisect.Renderer(scene, "cpu")
frame = renderer.render(32, denoise="svgf", aov=["id", "depth", "normal"])
frame

# %% [markdown]
# The image and the layers are arrays. Object 0 is the sky.

# %%
for number, name in enumerate(["sky", *scene.objects]):
    share = np.mean(frame.aovs["id"] == number)
    print(f"{name}: {100 * share:.1f} % of the pixels")
