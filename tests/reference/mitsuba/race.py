"""Compares the errors of Mitsuba's path tracer and of Trisect at equal time, on the same threads of one machine, one after the other.

    python3 race.py ../../../target/release/trisect ../../../scenes --seconds 10

Scenes: cornell_box; and rtiow_final with mirrors in place of fuzzy metals and Fresnel's equations in place of Schlick's
approximation, because Mitsuba has no other. Mitsuba's time is that of mi.render after a render that compiles it; rr_depth 5
is its default, `none` corresponds to Trisect without roulette. Trisect's time is that of the renderer, and of --budget.
Errors are relMSE against Trisect's image of --reference seconds; means of --seeds images. The results are in
docs/notebook/peers.md.
"""
import argparse
import json
import os
import re
import subprocess
import sys
import time

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))


def pfm(path):
    with open(path, "rb") as file:
        assert file.readline().strip() == b"PF"
        width, height = map(int, file.readline().split())
        little = float(file.readline()) < 0
        data = np.frombuffer(file.read(), "<f4" if little else ">f4").reshape(height, width, 3)
    return np.flipud(data).astype(np.float64)


def rel_mse(image, reference):
    return float(np.mean((image - reference) ** 2 / (reference ** 2 + 0.01)))


def work(variant, scene, seconds, threads, rr_depth, seeds):
    """Renders with a variant of Mitsuba. Runs in its own process, because a variant can be set only once."""
    import mitsuba as mi

    mi.set_variant(variant)
    if variant.startswith("llvm"):
        import drjit as dr

        dr.set_thread_count(threads)
    sys.path.insert(0, HERE)
    import convert

    def render(integrator, spp, seed):
        start = time.time()
        image = np.array(mi.render(world, integrator=integrator, spp=spp, seed=seed), np.float64)
        return image, time.time() - start

    world = convert.build(scene)
    with open(scene) as file:
        depth = int(re.search(r"depth: (\d+)", file.read()).group(1))
    integrator = mi.load_dict({"type": "path", "max_depth": depth, "rr_depth": rr_depth})
    render(integrator, 1, 0)
    spp = 4
    while True:
        render(integrator, spp, 0)
        _, took = render(integrator, spp, 1)
        if took > 0.85 * seconds:
            break
        spp = max(spp + 1, int(spp * min(seconds / took, 8)))
    for seed in range(seeds):
        image, took = render(integrator, spp, 100 + seed)
        np.save(f"/tmp/race.{seed}.npy", image)
        print(json.dumps({"spp": spp, "seconds": took}), flush=True)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("trisect")
    parser.add_argument("scenes")
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--reference", type=float, default=120)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--resolution", default="400x225")
    parser.add_argument("--worker", nargs=3)
    args = parser.parse_args()
    if args.worker:
        variant, scene, rr = args.worker
        return work(variant, scene, args.seconds, args.threads, int(rr), args.seeds)

    def trisect(*more):
        subprocess.run([args.trisect, "render", *map(str, more), "--backend", "cpu", "--threads", str(args.threads), "-q",
                        "--stats", "/tmp/race.json"], check=True)
        with open("/tmp/race.json") as file:
            return json.load(file)

    width, height = map(int, args.resolution.split("x"))
    for name in ["rtiow_final", "cornell_box"]:
        with open(os.path.join(args.scenes, name + ".ron")) as file:
            text = file.read()
        text = re.sub(r"fuzz: [0-9.e-]+", "fuzz: 0", text).replace("fresnel: Schlick", "fresnel: Exact")
        text = re.sub(r"width: \d+, height: \d+", f"width: {width}, height: {height}", text)
        scene = f"/tmp/race_{name}.ron"
        with open(scene, "w") as file:
            file.write(text)
        trisect(scene, "--budget", f"{args.reference}s", "--denoise", "off", "--seed", 77, "-o", "/tmp/race_reference.pfm")
        reference = pfm("/tmp/race_reference.pfm")
        rows = []
        for variant, rr in [("llvm_ad_rgb", 5), ("llvm_ad_rgb", 10 ** 6), ("scalar_rgb", 5), ("scalar_rgb", 10 ** 6)]:
            out = subprocess.run([sys.executable, __file__, args.trisect, args.scenes, "--seconds", str(args.seconds), "--seeds", str(args.seeds),
                                  "--threads", str(args.threads), "--worker", variant, scene, str(rr)], capture_output=True, text=True, check=True)
            lines = [json.loads(line) for line in out.stdout.splitlines() if line.startswith("{")]
            images = [np.load(f"/tmp/race.{seed}.npy") for seed in range(len(lines))]
            # Noise falls with the time, so the error is scaled to exactly the time.
            errors = [rel_mse(image, reference) * line["seconds"] / args.seconds for image, line in zip(images, lines)]
            rows.append((f"Mitsuba {variant}, rr_depth {'none' if rr > 1000 else rr}", lines[0]["spp"], np.mean([l["seconds"] for l in lines]), np.mean(errors),
                         np.mean(images) / reference.mean() - 1))
        plain = 16
        while True:
            took = trisect(scene, "--spp", plain, "-o", "/tmp/race.pfm")["phases"]["render_seconds"]
            if took > 0.9 * args.seconds:
                break
            plain = max(plain + 1, int(plain * min(args.seconds / took, 8)))
        for label, more in [("Trisect, --spp", ["--spp", plain]), ("Trisect, --budget, --denoise off", ["--budget", f"{args.seconds}s", "--denoise", "off"]),
                            ("Trisect, --budget", ["--budget", f"{args.seconds}s"])]:
            errors, times, spp, means = [], [], [], []
            for seed in range(args.seeds):
                stats = trisect(scene, *more, "--seed", seed, "-o", "/tmp/race.pfm")
                image = pfm("/tmp/race.pfm")
                seconds = stats["sampling"]["seconds"] if stats["sampling"] else stats["phases"]["render_seconds"]
                spp.append(stats["sampling"]["mean_samples"] if stats["sampling"] else plain)
                times.append(seconds)
                errors.append(rel_mse(image, reference) * seconds / args.seconds)
                means.append(image.mean() / reference.mean() - 1)
            rows.append((label, round(np.mean(spp)), np.mean(times), np.mean(errors), np.mean(means)))
        best = min(row[3] for row in rows if row[0].startswith("Mitsuba"))
        print(f"\n{name}, {args.resolution}, {args.threads} threads, {args.seconds} s\n")
        print("| | samples a pixel | seconds | relMSE | of Mitsuba's best | mean |\n|---|---|---|---|---|---|")
        for label, spp, seconds, error, mean in rows:
            print(f"| {label} | {spp} | {seconds:.2f} | {error:.3e} | {error / best:.2f} | {100 * mean:+.3f} % |", flush=True)


main()
