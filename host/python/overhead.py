"""Compares a loop over variants of a scene in Python with the same loop in Rust.

    cargo build --release -p trisect --example variants
    python host/python/overhead.py target/release/examples/variants [--pairs 21] [--count 100] [--threads 2]

Each variant is an edit of a material, an update of the renderer, a render of 64 x 36 pixels with 16 samples each on the
CPU, and its image. Processes of Rust and Python alternate. Prints the medians of the loops' times, and the median of the
ratios of pairs with an interval of 95 % by order statistics. The start of the processes is not counted, nor are the
first variants: threads that NumPy's OpenBLAS starts occupy a core for about 0.1 s after the import.
"""

import argparse
import json
import statistics
import subprocess
import sys
import time

# Number of variants before those that are timed.
WARM_UP = 50


def loop(count, threads):
    """Runs the loop of host/render/examples/variants.rs.

    Returns its seconds, those of its renders, its processor time in seconds, and a mean over all images.
    """
    import trisect

    scene = trisect.Scene.hello_world()
    renderer = trisect.Renderer(scene, "cpu", threads=threads)
    total, rendering, used, start = 0.0, 0.0, 0.0, 0.0
    for step in range(WARM_UP + count):
        if step == WARM_UP:
            total, rendering, used, start = 0.0, 0.0, time.process_time(), time.perf_counter()
        renderer.update(scene.edit({"materials.clay.albedo": (step / (WARM_UP + count), 0.25, 0.2)}))
        begun = time.perf_counter()
        frame = renderer.render(16, width=64, height=36)
        rendering += time.perf_counter() - begun
        image = frame.image
        total += float(image[0, 0, 0])
    seconds = time.perf_counter() - start
    return seconds, rendering, time.process_time() - used, total / count


def interval(ratios):
    """Returns the interval of 95 % of the median, by order statistics."""
    ordered, count = sorted(ratios), len(ratios)
    chance, rank = 0.5**count, 0
    below = chance
    while below < 0.025 and rank < count // 2:
        rank += 1
        chance *= (count - rank + 1) / rank
        below += chance
    rank = max(rank - 1, 0)
    return ordered[rank], ordered[-1 - rank]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rust", nargs="?", help="the example of the library")
    parser.add_argument("--pairs", type=int, default=21)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--loop", action="store_true", help="run Python's loop alone")
    args = parser.parse_args()
    if args.loop:
        print(json.dumps(loop(args.count, args.threads)))
        return
    if not args.rust:
        parser.error("name the example, target/release/examples/variants")
    commands = {
        "Rust": [args.rust, str(args.count), str(args.threads)],
        "Python": [sys.executable, __file__, "--loop", "--count", str(args.count), "--threads", str(args.threads)],
    }
    found = {name: [] for name in commands}
    for pair in range(args.pairs):
        # Each is first in half of the pairs.
        for name in sorted(commands, reverse=pair % 2 == 0):
            text = subprocess.run(commands[name], capture_output=True, text=True, check=True).stdout
            found[name].append([float(word) for word in text.strip("[]\n").replace(",", " ").split()])
    means = {round(run[3], 5) for runs in found.values() for run in runs}
    assert len(means) == 1, f"the loops render other images: {means}"
    print("| loop | seconds | of them renders | ms per variant outside of renders | processor seconds |")
    print("|---|---|---|---|---|")
    for name, runs in found.items():
        seconds, renders, processor = (statistics.median(column) for column in list(zip(*runs))[:3])
        other = 1e3 * statistics.median(run[0] - run[1] for run in runs) / args.count
        print(f"| {name} | {seconds:.3f} | {renders:.3f} | {other:.3f} | {processor:.3f} |")
    for label, column in [("seconds", 0), ("processor seconds", 2)]:
        ratios = [python[column] / rust[column] for rust, python in zip(found["Rust"], found["Python"])]
        low, high = interval(ratios)
        print(f"{label}, Python / Rust: {statistics.median(ratios):.3f} ({low:.3f} to {high:.3f}), {args.pairs} pairs")


if __name__ == "__main__":
    main()
