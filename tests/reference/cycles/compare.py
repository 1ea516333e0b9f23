#!/usr/bin/env python3
"""Compares Trisect with images of render_models.py: compare.py PROGRAM SAMPLES MODEL...

Prints for each model the relMSE, and the mean of both images by channel."""

import json
import re
import subprocess
import sys

SCENE = """Scene(version: 1, image: (width: 96, height: 96),
    camera: (look_from: (0, 0, 4), look_at: (0, 0, 0), vertical_fov: 40),
    sky: Gradient(bottom: (0.1, 0.1, 0.1), top: (0.1, 0.1, 0.1)),
    materials: {}, objects: [ Mesh(file: "%s") ])"""

program, samples = sys.argv[1:3]
print("| model | relMSE | Trisect | Cycles |\n|---|---|---|---|")
for model in sys.argv[3:]:
    name = model.removesuffix(".glb")
    with open(name + ".ron", "w") as file:
        file.write(SCENE % model)
    options = ["--spp", samples, "--depth", "17", "-q", "-o", name + ".exr"]
    time = re.search(r"_at_([0-9.]+s)", name)
    options += ["--time", time[1]] if time else []
    subprocess.run([program, "render", name + ".ron", *options], check=True)
    report = subprocess.run(
        [program, "compare", name + ".exr", name + ".cycles.exr", "--json"], check=True, capture_output=True
    )
    report = json.loads(report.stdout)
    means = [" ".join(f"{x:.4f}" for x in report[key]) for key in ("mean_a", "mean_b")]
    print(f"| `{name}` | {report['rel_mse']:.1e} | {means[0]} | {means[1]} |", flush=True)
