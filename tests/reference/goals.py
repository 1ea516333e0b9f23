"""Measures whether `render --budget`, `--adaptive` and `--target-error` keep their promises.

Its tables are in docs/notebook/samplers-and-adaptive.md.

    goals.py budget   TRISECT SCENES    compares --budget with the default settings, with as many samples as fit the time
    goals.py adaptive TRISECT SCENES    compares adaptive with uniform sampling, at equal time
    goals.py target   TRISECT SCENES    compares the requested error with that against 16 times the samples

TRISECT is the program, SCENES the folder of its scenes. Needs Python 3.8 and no packages.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ALL = "rtiow_final,cornell_box,veach_mis,furnace,mesh,many_lights"
TRIES = 9


class Program:
    """Runs the program."""

    def __init__(self, options, folder):
        self.options, self.folder = options, folder

    def run(self, *arguments):
        done = subprocess.run([self.options.trisect, *map(str, arguments)], capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"{' '.join(map(str, arguments))}: {done.stderr.strip()}")
        return done.stdout

    def render(self, scene, backend, image, *arguments):
        """Renders an image and returns the statistics."""
        stats = self.folder / "stats.json"
        place = ["--backend", backend, "--resolution", self.options.resolution]
        if backend == "wgpu" and self.options.device is not None:
            place += ["--device", self.options.device]
        file = Path(self.options.scenes) / f"{scene}.ron"
        self.run("render", file, *place, "-o", image, "--stats", stats, "-q", *arguments)
        return json.loads(stats.read_text())

    def error(self, image, reference):
        """Returns relMSE of an image against a reference."""
        return json.loads(self.run("compare", image, reference, "--json"))["rel_mse"]

    def reference(self, scene, backend):
        """Returns the path of a long render with a seed that no other render has; it is kept for the other backends."""
        path = self.folder / f"{scene}.pfm"
        if not path.exists():
            goal = ["--budget", self.options.reference, "--denoise", "off", "--seed", 4242]
            noise = self.render(scene, backend, path, *goal)["sampling"]["noise"]["error"]
            print(f"{scene}: the reference's own error is {100 * noise:.3f} %", flush=True)
        return path


def default_within(program, scene, backend, seconds, image, rate):
    """Renders with the default settings and as many samples as fit the time; returns the samples and the time that they took."""
    samples = max(1, int(rate * seconds)) if rate else 8
    took = 0.0
    for _ in range(TRIES):
        stats = program.render(scene, backend, image, "--spp", samples, "--seed", 5)
        took = stats["phases"]["render_seconds"]
        if 0.93 < took / seconds < 1.07 or samples == 1 and took > seconds:
            break
        samples = max(1, int(samples * min(seconds / took, 60)))
    return samples, took


def budget(program, options):
    start, rates = time.time(), {}
    image, default = program.folder / "budget.pfm", program.folder / "default.pfm"
    for seconds in map(float, options.seconds.split(",")):
        for backend in options.backend.split(","):
            for scene in options.only.split(","):
                if time.time() - start + 2.4 * seconds + 6 > options.limit:
                    print(f"{backend} {scene} {seconds} s: no time left", flush=True)
                    continue
                reference = program.reference(scene, options.backend.split(",")[0])
                if (scene, backend) not in rates:
                    # Kernels are compiled once per device and cached by its driver.
                    program.render(scene, backend, image, "--budget", "1s", "--seed", 77)
                found = program.render(scene, backend, image, "--budget", f"{seconds}s", "--seed", 5)["sampling"]
                error = program.error(image, reference)
                rate = rates.get((scene, backend))
                samples, took = default_within(program, scene, backend, seconds, default, rate)
                rates[scene, backend] = samples / took
                # Noise falls with the samples, so the error is scaled to exactly the time.
                plain = program.error(default, reference) * took / seconds
                way = found["way"]
                words = [way["sampler"]]
                words += ["roulette"] if way["roulette"] else []
                words += [way["denoise"]["filter"]] if way["denoise"] else []
                words += ["adaptive"] if found["adaptive"] else []
                print(
                    f"{backend:5}{scene:12}{seconds:5} s: time {found['seconds'] / seconds:.3f}, better {plain / error:.2f}x; "
                    f"error {100 * error**0.5:.3f} % (expected {100 * found['expected_error']:.3f}), default {100 * plain**0.5:.3f} %; "
                    f"{found['mean_samples']:.0f} of {samples} samples; {', '.join(words)}",
                    flush=True,
                )


def adaptive(program, options):
    image = program.folder / "image.pfm"
    fixed = ["--sampler", "independent", "--roulette", "off", "--denoise", "off"]
    seconds = options.seconds.split(",")[0]
    for backend in options.backend.split(","):
        for scene in options.only.split(","):
            reference = program.reference(scene, backend)
            errors, taken, gain = {}, 0, 0.0
            for way in ("off", "on", "auto"):
                errors[way] = 0.0
                for seed in range(options.seeds):
                    goal = ["--budget", f"{seconds}s", "--adaptive", way, "--seed", seed]
                    found = program.render(scene, backend, image, *goal, *fixed)["sampling"]
                    errors[way] += program.error(image, reference)
                    taken += way == "auto" and found["adaptive"]
                    gain = found["adaptive_gain"]
            print(
                f"{backend:5}{scene:12}: relMSE of uniform over adaptive {errors['off'] / errors['on']:.2f}, said {gain:.2f}; "
                f"auto {errors['off'] / errors['auto']:.2f}, adaptive in {taken} of {options.seeds}",
                flush=True,
            )


def target(program, options):
    image, reference = program.folder / "image.pfm", program.folder / "reference.pfm"
    for backend in options.backend.split(","):
        for scene in options.only.split(","):
            goal = ["--target-error", options.error]
            found = program.render(scene, backend, image, *goal)["sampling"]
            samples = max(64, int(16 * found["mean_samples"]))
            program.render(scene, backend, reference, "--spp", samples, "--sampler", "sobol", "--seed", 99)
            error = program.error(image, reference) ** 0.5
            print(
                f"{backend:5}{scene:12}: asked {options.error}, said {100 * found['noise']['error']:.3f} %, "
                f"true {100 * error:.3f} %; {found['mean_samples']:.1f} samples, {samples} in the reference",
                flush=True,
            )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["budget", "adaptive", "target"])
    parser.add_argument("trisect")
    parser.add_argument("scenes")
    parser.add_argument("--only", default=ALL, help="comma-separated scenes")
    parser.add_argument("--backend", default="cpu", help="comma-separated backends; the first renders the references")
    parser.add_argument("--device", help="device index for wgpu")
    parser.add_argument("--resolution", default="200x112")
    parser.add_argument("--seconds", default="0.5,2,10", help="comma-separated budgets in seconds; `adaptive` uses the first")
    parser.add_argument("--reference", default="60s", help="budget of a reference")
    parser.add_argument("--error", default="5%", help="target error of `target`")
    parser.add_argument("--seeds", type=int, default=3, help="number of seeds of `adaptive`")
    parser.add_argument("--limit", type=float, default=3600, help="seconds after which no budget is started")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        {"budget": budget, "adaptive": adaptive, "target": target}[options.what](Program(options, Path(folder)), options)


if __name__ == "__main__":
    main()
