#!/usr/bin/env python3
"""Measures the goals of docs/notebook/goals.md on this machine and prints its tables.

    tests/gpu_goals.py target/release/trisect [--before OTHER_PROGRAM] [--mitsuba PYTHON] [--quick]

It needs scenes/generated/asteroid_500k.ply, asteroid.ply and the rooms:

    cargo generate-scene mesh_ply scenes/generated/asteroid_500k.ply 158
    cargo generate-scene mesh_ply scenes/generated/asteroid.ply
    cargo generate-scene rooms scenes/generated

With --before each scene is also measured with another program, in both orders; with --mitsuba the room also by Mitsuba,
which that Python interpreter imports, on the GPU and on all threads of the CPU. --quick renders small images on the CPU, to
try the script. A combination that is not available here is printed as "-".
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys

# Work: scene, image size, samples, options, whether the goal counts rays, and for each backend and math what was
# measured before, the goal and what was predicted before the last change, in millions a second.
GOALS = {
    "book, 1280x720, 30 spp": ("rtiow_final.ron", "1280x720", 30, ["--roulette", "on"], False, {
        ("cuda", "fast"): (9300, 10000, 9700), ("cuda", "precise"): (7800, 9000, 8500),
        ("wgpu", "precise"): (6100, 8100, 6200)}),
    "book, 1920x1080, 64 spp": ("rtiow_final.ron", "1920x1080", 64, ["--roulette", "on"], False, {
        ("cuda", "fast"): (11000, 13000, 11200), ("cuda", "precise"): (9100, 11700, 9900),
        ("wgpu", "precise"): (6800, 10500, 6900)}),
    "`materials`": ("materials.ron", "1280x720", 16, [], False, {
        ("cuda", "precise"): (261, 900, 900), ("wgpu", "precise"): (881, 1100, 940)}),
    "`features.glb`": ("gltf/features.glb", "1280x720", 16, [], False, {
        ("cuda", "precise"): (205, 500, 640), ("wgpu", "precise"): (256, 500, 420)}),
    "room, 0.5 M triangles, depth 8, 64 spp": ("generated/room.ron", "1280x720", 64, [], False, {
        ("cuda", "fast"): (220, 310, 420)}),
    "mesh of 0.5 M triangles, rays": ("generated/goals_view.ron", "1280x720", 16, [], True, {
        ("cuda", "fast"): (2200, 4000, 2900), ("wgpu", "precise"): (2100, 3500, 2700)}),
}

# Scene, and the predicted ratio of fast to precise time on CUDA.
EIGHT = {"rtiow_final.ron": 0.90, "cornell_box.ron": 0.89, "veach_mis.ron": 0.68, "next_week.ron": 0.76,
         "materials.ron": 0.64, "many_lights.ron": 0.90, "gltf/features.glb": 0.81, "generated/room.ron": 0.91}

VIEW = """Scene(
    version: 1,
    image: (width: 1280, height: 720, samples: 16, depth: 8),
    camera: (look_from: (0, 0, 1.6), look_at: (0, 0, 0), vertical_fov: 40),
    sky: Uniform(radiance: (1, 1, 1)),
    materials: {"grey": Lambertian(albedo: (0.7, 0.7, 0.7))},
    objects: [Mesh(file: "asteroid_500k.ply", material: "grey")],
)
"""


class Bench:
    """Runs the program's benchmark, with the drivers' caches off."""

    def __init__(self, quick):
        self.quick = quick
        self.scenes = pathlib.Path(__file__).resolve().parent.parent / "scenes"
        self.environment = {**os.environ, "CUDA_CACHE_DISABLE": "1", "__GL_SHADER_DISK_CACHE": "0"}

    def run(self, program, scene, backend, math, size, spp, options):
        """Returns device time in ms, million samples a second, million rays a second and the start in s; None
        without such a device."""
        if self.quick:
            backend, math, size, spp = "cpu", "precise", "64x36", 2
        command = [program, "bench", self.scenes / scene, "--backend", backend, "--math", math, "--resolution", size,
                   "--spp", str(spp), "--frames", "2" if self.quick else "9", "--json", "-", *options]
        run = subprocess.run(command, capture_output=True, text=True, env=self.environment)
        if run.returncode != 0:
            if "not available" in run.stderr:
                return None
            sys.exit(f"{' '.join(map(str, command))}: {run.stderr}")
        report = json.loads(run.stdout)
        time = report["rows"][0]["summary"]["least"]
        width, height = map(int, size.split("x"))
        rate = width * height * spp / time / 1e3
        return time, rate, rate * report["segments_per_sample"], report["once"]["start_to_first_kernel_seconds"]


def cell(value, digits=0):
    return "-" if value is None else f"{value:,.{digits}f}"


def goals(bench, program):
    print("| work | backend | before | goal | predicted | measured | of the goal |\n|---|---|---|---|---|---|---|")
    for work, (scene, size, spp, options, rays, rows) in GOALS.items():
        for (backend, math), (before, goal, predicted) in rows.items():
            found = bench.run(program, scene, backend, math, size, spp, options)
            rate = found and found[2 if rays else 1]
            print(f"| {work} | {backend} {math} | {before:,} | {goal:,} | {predicted:,} | {cell(rate)} | "
                  f"{cell(rate and rate / goal, 2)} |", flush=True)


def ratios(bench, program):
    print("\n| scene | CUDA precise / fast, ms | fast over precise | predicted | wgpu precise, ms | CUDA over wgpu |"
          "\n|---|---|---|---|---|---|")
    for scene, predicted in EIGHT.items():
        found = [bench.run(program, scene, backend, math, "1280x720", 16, []) for backend, math in
                 (("cuda", "precise"), ("cuda", "fast"), ("wgpu", "precise"))]
        precise, fast, wgpu = (run and run[0] for run in found)
        print(f"| `{scene}` | {cell(precise, 3)} / {cell(fast, 3)} | "
              f"{cell(precise and fast and fast / precise, 2)} | {predicted:.2f} | {cell(wgpu, 3)} | "
              f"{cell(precise and wgpu and precise / wgpu, 2)} |", flush=True)


def beside_mitsuba(bench, program, python):
    print("\n| room | Trisect | Mitsuba | ratio |\n|---|---|---|---|")
    peer = pathlib.Path(__file__).resolve().parent / "reference" / "mitsuba" / "room.py"
    for variant, backend, math, size, spp in (("cuda_ad_rgb", "cuda", "fast", "1280x720", 64),
                                              ("cuda_ad_rgb", "cuda", "precise", "1280x720", 64),
                                              ("llvm_ad_rgb", "cpu", "precise", "640x360", 16)):
        ours, theirs = [], []
        for _ in range(2):
            found = bench.run(program, "generated/room.ron", backend, math, size, spp, [])
            run = subprocess.run([python, peer, variant, bench.scenes / "generated", "--resolution", size, "--spp", str(spp)],
                                 capture_output=True, text=True)
            ours += [found[1]] if found else []
            theirs += [json.loads(run.stdout)["million_samples_a_second"]] if run.returncode == 0 else []
        mine, peers = max(ours, default=None), max(theirs, default=None)
        print(f"| {backend} {math}, `{variant}`, {size}, {spp} spp | {cell(mine, 2)} | {cell(peers, 2)} | "
              f"{cell(mine and peers and mine / peers, 2)} |", flush=True)


def before_and_now(bench, before, now):
    print("\n| scene | backend | before, ms | now, ms | ratio | start before, s | start now, s |\n|---|---|---|---|---|---|---|")
    for scene in list(EIGHT)[:5] + ["three_spheres.ron"]:
        for backend in ("cuda", "wgpu"):
            for math in ("precise", "fast"):
                runs = {before: [], now: []}
                for program in (before, now, now, before):
                    found = bench.run(program, scene, backend, math, "1280x720", 16, ["--roulette", "on"])
                    runs[program] += [found] if found else []
                if not all(runs.values()):
                    continue
                old, new = min(runs[before]), min(runs[now])
                print(f"| `{scene}` | {backend} {math} | {old[0]:.3f} | {new[0]:.3f} | {new[0] / old[0]:.3f} | "
                      f"{old[3]:.2f} | {new[3]:.2f} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--before")
    parser.add_argument("--mitsuba", metavar="PYTHON")
    parser.add_argument("--quick", action="store_true")
    arguments = parser.parse_args()
    bench = Bench(arguments.quick)
    (bench.scenes / "generated" / "goals_view.ron").write_text(VIEW)
    goals(bench, arguments.program)
    ratios(bench, arguments.program)
    if arguments.mitsuba:
        beside_mitsuba(bench, arguments.program, arguments.mitsuba)
    if arguments.before:
        before_and_now(bench, arguments.before, arguments.program)


if __name__ == "__main__":
    main()
