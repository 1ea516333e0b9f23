#!/usr/bin/env python3
"""Compares Trisect with images of render_models.py: compare.py render|table|store PROGRAM SAMPLES MODEL...

`render` makes NAME.LIGHT.trisect.pfm. `table` prints for each light the difference of the means by channel, the share
of blocks of 8 x 8 pixels that differ by more than 2 % in a channel, and the relMSE of the blocks. `store` writes the
means of the blocks of Cycles to the folder images. PROGRAM and SAMPLES are for `render` alone."""

import json
import os
import re
import subprocess
import sys

SCENE = """Scene(
    version: 1,
    image: (width: 64, height: 64, depth: 17),
    %s
    sky: %s,
    materials: {},
    objects: [Mesh(file: "%s")],
)
"""
CAMERA = "camera: (look_from: (0, 0, 4), look_at: (0, 0, 0), vertical_fov: 40),"
SKIES = {"uniform": "Uniform(radiance: (0.1, 0.1, 0.1))", "panorama": 'Image(file: "panorama.pfm")'}


def has_camera(model):
    with open(model, "rb") as file:
        return b'"cameras"' in file.read()


def render(program, samples, model, name):
    for light, sky in SKIES.items():
        scene = f"{name}.{light}.ron"
        with open(scene, "w") as file:
            file.write(SCENE % ("" if has_camera(model) else CAMERA, sky, model))
        options = ["--spp", samples, "-q", "-o", f"{name}.{light}.trisect.pfm"]
        time = re.search(r"_at_([0-9.]+s)", name)
        options += ["--time", time[1]] if time else []
        subprocess.run([program, "render", scene, *options], check=True)
        os.remove(scene)


def blocks(path, side=8):
    """Returns the means of blocks of a PFM file, the lowest row first."""
    import numpy

    with open(path, "rb") as file:
        file.readline()
        width, height = map(int, file.readline().split())
        file.readline()
        pixels = numpy.frombuffer(file.read(), "<f4").reshape(height, width, 3).astype("f8")
    return pixels.reshape(height // side, side, width // side, side, 3).mean((1, 3))


def compare(name, light):
    import numpy

    ours, theirs = blocks(f"{name}.{light}.trisect.pfm"), blocks(f"{name}.{light}.pfm")
    means = ours.mean((0, 1)) / theirs.mean((0, 1)) - 1
    beyond = (abs(ours / numpy.maximum(theirs, 1e-6) - 1).max(2) > 0.02).mean()
    error = ((ours - theirs) ** 2 / (theirs**2 + 0.01)).mean()
    shown = " ".join(f"{100 * x:+.2f}" for x in means)
    return f"{shown} | {100 * beyond:.0f} | {error:.1e}"


def store(name, light):
    means = blocks(f"{name}.{light}.pfm").astype("<f4")
    os.makedirs("images", exist_ok=True)
    with open(f"images/{name}.{light}.pfm", "wb") as file:
        file.write(f"PF\n{means.shape[1]} {means.shape[0]}\n-1.0\n".encode() + means.tobytes())


command, program, samples = sys.argv[1:4]
if command == "table":
    print("| model | uniform: means, % | blocks, % | relMSE | panorama: means, % | blocks, % | relMSE |")
    print("|---|---|---|---|---|---|---|")
for model in sys.argv[4:]:
    name = re.sub(r"\.gl(b|tf)$", "", model)
    if command == "render":
        render(program, samples, model, name)
    elif command == "table":
        print(f"| `{name}` |", " | ".join(compare(name, light) for light in SKIES), "|", flush=True)
    else:
        for light in SKIES:
            store(name, light)
