#!/usr/bin/env python3
"""Makes the tables of docs/notebook/torture-tests.md from what the torture tests print.

    cargo test --release -p trisect-tests --test torture -- --nocapture --test-threads=1 > HERE.log 2>&1
    tests/accuracy.py HERE.log GPU.log

The first log is from a machine without a GPU (its wgpu is lavapipe), the second from one with an NVIDIA GPU.
"""
import re
import sys

TESTS = {
    1: "mutation gate", 2: "closed emissive sphere", 3: "NaN and infinity before the firewall", 4: "random number parity",
    5: "random extremes through each sampler", 6: "rows in parts", 7: "samples in parts", 8: "scene scaled by 2^k",
    9: "BVH against brute force", 10: "white furnace of each material", 11: "far spheres", 12: "re-intersection",
    13: "watertight meshes", 14: "index-matched sphere", 15: "Fresnel against f64", 16: "critical angle",
    17: "instruction audit", 18: "census of operations", 19: "bits of hits and radiance", 20: "first hits",
    21: "2^25 samples of 0.1", 22: "cancellation", 23: "flat quads along axes", 24: "thin slabs", 25: "tiny components",
    26: "on, in and beside a sphere", 27: "impossible radii", 28: "degenerate triangles", 29: "scene moved by 2^k",
    30: "ground sphere and plane", 31: "hollow and nested glass", 32: "camera within", 33: "no zero direction",
    34: "chi-square of each lobe", 35: "roulette", 36: "enclosures", 37: "denoiser: constant image",
    38: "denoiser: sigma 0 and infinite", 39: "denoiser: NaN, fireflies, black albedo", 40: "denoiser: error by samples",
    41: "boxes contain what they hold", 42: "denormal scene", 43: "convergence slope",
    44: "visits at the extremes", 45: "coarse mirrors",
}
FIXED = {
    (1, "*"): ("passed", "`cargo mutation-gate`: each mutant is caught"),
    (17, "cpu"): ("not applicable: rustc contracts nothing", ""),
    (19, "cpu"): ("is the reference", ""),
    (20, "cpu"): ("is the reference", ""),
}


def read(path):
    """Returns outcomes and figures by number and label, and the census by operation and label."""
    found, census = {}, {}
    for line in open(path, encoding="utf-8", errors="replace"):
        if match := re.search(r"TORTURE (\d+) \| (\S+) \| (.*?) \| (passed|bounded|not applicable) \| (.*)", line):
            number, label, _, outcome, figure = match.groups()
            found.setdefault((int(number), label), []).append((outcome, figure.strip()))
        elif match := re.search(r"CENSUS \| (\S+) \| (.*?) \| (.*)", line):
            label, name, text = match.groups()
            census.setdefault(name, {})[label] = [part.strip() for part in text.split(" | ")]
    return found, census


def cell(found, number, label):
    fixed = FIXED.get((number, label)) or FIXED.get((number, "*"))
    if fixed:
        return fixed
    parts = found.get((number, label)) or (found.get((number, "cpu")) if number == 41 else None)
    if not parts:
        return "MISSING", ""
    worst = next((o for o in ("bounded", "not applicable") if any(o == part[0] for part in parts)), "passed")
    return worst, "; ".join(figure for _, figure in parts)


def main():
    here, census = read(sys.argv[1])
    gpu, gpu_census = read(sys.argv[2])
    columns = [(here, "cpu"), (gpu, "cuda"), (gpu, "wgpu"), (here, "wgpu")]
    print("| | test | CPU | CUDA, H100 | wgpu, H100 | wgpu, lavapipe | figures |\n|---|---|---|---|---|---|---|")
    names = ["CPU", "CUDA", "H100's Vulkan", "lavapipe"]
    for number, name in TESTS.items():
        cells = [cell(found, number, label) for found, label in columns]
        figures = {}
        for who, (_, figure) in zip(names, cells):
            if figure:
                figures.setdefault(figure, []).append(who)
        text = "; ".join(f if len(figures) == 1 else f"**{', '.join(who)}**: {f}" for f, who in figures.items())
        print(f"| {number} | {name} | " + " | ".join(outcome for outcome, _ in cells) + f" | {text} |")
    print()
    print("| operation | CPU, CUDA | wgpu, H100 | wgpu, lavapipe |\n|---|---|---|---|")
    kinds = ["normal", "denormal", "infinite"]
    for name, labels in census.items():
        row = []
        for parts in (labels["cpu"], gpu_census.get(name, {}).get("wgpu", ["MISSING"]), labels.get("wgpu", ["MISSING"])):
            if len(set(parts)) == 1:
                row.append(parts[0])
            else:
                row.append("; ".join(f"{kind}: {part}" for kind, part in zip(kinds, parts)))
        if gpu_census.get(name, {}).get("cuda") != labels["cpu"]:
            row[0] += " (CUDA: " + "; ".join(gpu_census.get(name, {}).get("cuda", ["MISSING"])) + ")"
        print(f"| {name} | " + " | ".join(row) + " |")

    print()
    costs(sys.argv[2])


def costs(path):
    """Prints the table of visits: for each scene and kind of rays, mean and maximum of exact rays and of the same rays tilted."""
    rows = {}
    for line in open(path, encoding="utf-8", errors="replace"):
        match = re.search(r"COST (\S+ \S+) \| (.*?) \| (.*?) \| nodes (.*?) tilted (.*?) \| leaves (.*?) tilted ([^|]*)(?:\| obvhs tests (.*))?", line)
        if match:
            traversal, scene, family, nodes, nodes_tilted, leaves, leaves_tilted, obvhs = match.groups()
            row = rows.setdefault((scene, family), {})
            row[traversal] = (f"{nodes}, {leaves}", f"{nodes_tilted}, {leaves_tilted.strip()}")
            row["obvhs"] = obvhs or row.get("obvhs", "")
    print("| scene | rays | CPU, stack | tilted | CPU, wide | tilted | obvhs tests | CUDA, stack | wgpu, stack |")
    print("|---|---|---|---|---|---|---|---|---|")
    for (scene, family), row in rows.items():
        missing = ("MISSING", "MISSING")
        cells = [*row.get("cpu stack", missing), *row.get("cpu wide", missing), row["obvhs"].strip()]
        for device in ("cuda stack", "wgpu stack"):
            exact, _ = row.get(device, missing)
            cells.append("the same" if exact == cells[0] else exact)
        print(f"| {scene} | {family} | " + " | ".join(cells) + " |")


main()
