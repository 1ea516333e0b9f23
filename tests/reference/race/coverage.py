"""Counts how often the intervals of trisect.evaluate cover the truth, on images of Mitsuba 3 and Blender's Cycles.

    python3 coverage.py --mitsuba MITSUBA/bin/python --cycles BPY/bin/python

MITSUBA and BPY are virtual environments as for race.py; the Python that runs this has the module trisect. Each repetition
evaluates images of seeds of its own against the reference, which is made of images of the same renderer with more samples.
The truth of a figure is its mean over the images of all repetitions, beside the mean of the reference's images and of those.
A row says how many of the repetitions' intervals hold the truth, for relMSE and for the variance, and how many see no bias.
The control is the truth of another number of samples, which intervals must not hold.
"""
import argparse
import os
import subprocess
import tempfile

import numpy as np

from race import HERE, SCENES, prepare

import trisect

RENDERERS = {"Mitsuba": ("with_mitsuba.py", "roulette 5"), "Cycles": ("with_cycles.py", "light tree")}


def rel_mse(images, truth):
    """Returns the relMSE of images, shape (n, height, width, 3), over all of them."""
    return float(np.mean((images - truth) ** 2 / (truth**2 + 0.01)))


def holds(interval, truth):
    return interval["low"] <= truth <= interval["high"]


def measure(renderer, name, args, folder):
    """Prints how often intervals hold the truth for the images of one renderer and scene."""
    file, width, height = SCENES[name]
    scene = os.path.join(folder, f"{name}.ron")
    prepare(os.path.join(HERE, file), scene, width // args.divisor, height // args.divisor)
    script, setting = RENDERERS[renderer]

    def render(spp, first_seed, seeds):
        out = os.path.join(folder, "image")
        python = args.mitsuba if renderer == "Mitsuba" else args.cycles
        command = [python, os.path.join(HERE, script), scene, setting, "--spp", str(spp), "--first-seed", str(first_seed),
                   "--seeds", str(seeds), "--threads", str(args.threads), "--out", out]
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        if done.returncode:
            raise SystemExit(f"{' '.join(command)}\n{done.stderr[-2000:]}")
        return np.array([np.load(f"{out}.{seed}.npy") for seed in range(seeds)])

    images = render(args.spp, 100, args.repetitions * args.images)
    reference = render(args.spp * args.more, 100_000, args.references)
    weights = [len(images), len(reference) * args.more]
    truth = np.average([images.mean(0), reference.mean(0)], axis=0, weights=weights)
    # The mean of all images has noise of its own, of which each image is a part.
    error = rel_mse(images, truth) * (1 + 1 / sum(weights))
    kept = [image.astype(np.float32) for image in reference]
    counts = {"rel_mse": 0, "variance": 0, "unbiased": 0, "control": 0}
    for first in range(0, len(images), args.images):
        part = [image.astype(np.float32) for image in images[first:first + args.images]]
        errors = trisect.evaluate(part, kept)["rows"][0]["errors"]
        counts["rel_mse"] += holds(errors["rel_mse"], error)
        counts["variance"] += holds(errors["variance"], error)
        counts["unbiased"] += not errors["biased"]
        counts["control"] += holds(errors["variance"], 2 * error)
    print(f"| {renderer} | {name} | {args.spp} | {100 * error ** 0.5:.1f} % | "
          + " | ".join(f"{count} of {args.repetitions}" for count in counts.values()) + " |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--mitsuba", metavar="PYTHON", help="a Python with mitsuba")
    parser.add_argument("--cycles", metavar="PYTHON", help="a Python with bpy")
    parser.add_argument("--scenes", nargs="*", choices=SCENES, default=["cornell_box", "rtiow_final", "room_morning"])
    parser.add_argument("--repetitions", type=int, default=100)
    parser.add_argument("--images", type=int, default=4, help="images of a repetition")
    parser.add_argument("--references", type=int, default=8, help="images of the reference")
    parser.add_argument("--spp", type=int, default=16)
    parser.add_argument("--more", type=int, default=64, help="samples of the reference's images, times those of the others")
    parser.add_argument("--divisor", type=int, default=4, help="divisor of the width and height of images")
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    args = parser.parse_args()
    print("| renderer | scene | samples a pixel | error | relMSE held | variance held | no bias seen | control: twice the variance |")
    print("|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for renderer, python in (("Mitsuba", args.mitsuba), ("Cycles", args.cycles)):
            for name in args.scenes if python else []:
                measure(renderer, name, args, folder)


if __name__ == "__main__":
    main()
