"""Measures Mitsuba's path tracer in the closed room with a mesh of half a million triangles.

    python3 room.py VARIANT ../../../scenes/generated [--resolution 1280x720] [--spp 64] [--threads N]

It prints a line of JSON: million samples a second of the fastest of --frames renders, and the mean of the image.
The scene is that of scenes/generated/room.ron. A time is that of mi.render, after a render that compiles it and with the
device idle before and after. Only the standard library and Mitsuba are needed.
"""
import argparse
import json
import time

import drjit as dr
import mitsuba as mi

WALLS = [  # corner, u, v of the quads in room.ron, the normal u x v
    ((-2, 0, -2), (0, 0, 4), (4, 0, 0)), ((-2, 3, -2), (4, 0, 0), (0, 0, 4)), ((-2, 0, -2), (4, 0, 0), (0, 3, 0)),
    ((-2, 0, 2), (0, 3, 0), (4, 0, 0)), ((-2, 0, -2), (0, 3, 0), (0, 0, 4)), ((2, 0, -2), (0, 0, 4), (0, 3, 0))]
LIGHT = ((-0.5, 2.99, -0.5), (1, 0, 0), (0, 0, 1))


def quad(corner, u, v, turned=False):
    """Returns the parallelogram as a rectangle of Mitsuba, whose corners are at -1 and 1. `turned`: its front is the other."""
    n = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
    size = sum(c * c for c in n) ** 0.5
    columns = [[c / 2 for c in u], [c / 2 for c in v], [c / size for c in n],
               [corner[i] + u[i] / 2 + v[i] / 2 for i in range(3)]]
    rows = [[column[i] for column in columns] for i in range(3)] + [[0, 0, 0, 1]]
    return {"type": "rectangle", "to_world": mi.ScalarTransform4f(rows)}


def scene(folder, width, height):
    t = mi.ScalarTransform4f
    grey = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.7, 0.7, 0.7]}}}
    parts = {
        "type": "scene",
        "sensor": {
            "type": "perspective", "fov_axis": "y", "fov": 60, "near_clip": 1e-3, "far_clip": 1e4,
            "to_world": t().look_at([0, 1.6, 1.9], [0, 0.9, 0], [0, 1, 0]),
            "film": {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"},
                     "pixel_format": "rgb", "component_format": "float32", "sample_border": False},
            "sampler": {"type": "independent"},
        },
        "mesh": {"type": "ply", "filename": f"{folder}/asteroid_500k.ply", "bsdf": grey,
                 "to_world": t().translate([0, 0.8, 0]).scale(0.6)},
        "light": {**quad(*LIGHT), "bsdf": {"type": "diffuse", "reflectance": 0.0},
                  "emitter": {"type": "area", "radiance": {"type": "rgb", "value": [12, 12, 12]}}},
    }
    for number, wall in enumerate(WALLS):
        parts[f"wall_{number}"] = {**quad(*wall), "bsdf": grey}
    return mi.load_dict(parts)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("variant")
    parser.add_argument("folder")
    parser.add_argument("--resolution", default="1280x720")
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--frames", type=int, default=5)
    parser.add_argument("--threads", type=int)
    arguments = parser.parse_args()
    mi.set_variant(arguments.variant)
    if arguments.threads:
        dr.set_thread_count(arguments.threads)
    width, height = map(int, arguments.resolution.split("x"))
    world = scene(arguments.folder, width, height)
    integrator = mi.load_dict({"type": "path", "max_depth": 8, "rr_depth": 1000})
    times = []
    for seed in range(arguments.frames + 1):
        dr.sync_thread()
        start = time.perf_counter()
        image = mi.render(world, integrator=integrator, spp=arguments.spp, seed=seed)
        dr.eval(image)
        dr.sync_thread()
        times.append(time.perf_counter() - start)
    rate = width * height * arguments.spp / min(times[1:]) / 1e6
    mean = dr.mean(image, axis=None)
    print(json.dumps({"million_samples_a_second": rate, "mean": float(mean.array[0])}), flush=True)


main()
