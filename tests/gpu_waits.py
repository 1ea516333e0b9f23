#!/usr/bin/env python3
"""Measures what a user waits for besides kernels, and prints the tables of docs/notebook/waits.md.

    tests/gpu_waits.py target/release/trisect [--before OTHER_PROGRAM] [--threads 16,4] [--quick]

Each row is measured with both programs in turn. With --threads the process is confined to so many processors (taskset),
and once more with a process that copies memory on each of them. --quick renders small images on the CPU, to try the
script. A combination that is not available here is printed as "-".
"""
import argparse
import contextlib
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

SCENE = pathlib.Path(__file__).resolve().parent.parent / "scenes" / "rtiow_final.ron"
# Samples per pixel, and the goal: the largest ratio of the time on the host to that of the device, or the largest
# difference in ms.
FRAMES = {1: (None, 4.0), 16: (None, None), 256: (1.2, None), 4096: (1.03, None)}
COPY = "import sys\na = bytearray(1 << 28)\nwhile True: b = bytes(a)"


class Machine:
    """Runs a program on some processors, or finds out that it cannot."""

    def __init__(self, quick, processors):
        self.quick, self.processors = quick, processors
        self.confined_to = ",".join(map(str, sorted(os.sched_getaffinity(0))[:processors]))
        self.device = ["--backend", "cpu"] if quick else ["--backend", "cuda", "--math", "fast"]
        self.size = "96x54" if quick else "1920x1080"

    def start(self, command, **options):
        return subprocess.Popen(["taskset", "-c", self.confined_to, *map(str, command)], **options)

    def run(self, command):
        """Returns what the command printed and its seconds; None for a device or option that it lacks."""
        start = time.monotonic()
        run = self.start(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        out, said = run.communicate()
        if run.returncode == 0:
            return out, time.monotonic() - start
        if "not available" in said or "unexpected argument" in said:
            return None
        sys.exit(f"{' '.join(map(str, command))}: {said}")

    @contextlib.contextmanager
    def load(self, loaded):
        others = [self.start([sys.executable, "-c", COPY]) for _ in range(self.processors if loaded else 0)]
        try:
            yield
        finally:
            for other in others:
                other.kill()
                other.wait()

    def frame(self, program, samples):
        """Returns the ms of a frame on the device and on the host, in a program that renders frame after frame."""
        found = self.run([program, "bench", SCENE, *self.device, "--resolution", self.size, "--spp", samples,
                          "--frames", 5, "--json", "-"])
        if not found:
            return None
        rows = {row["name"]: row["summary"]["median"] for row in json.loads(found[0])["rows"]}
        return rows["device time"], rows["frame on the host"]

    def render(self, program, options):
        """Returns the statistics of a render to a file, and the seconds until the image and of the whole program."""
        with tempfile.TemporaryDirectory() as folder:
            start = time.time()
            found = self.run([program, "render", *options, *self.device, "-q", "-o", f"{folder}/a.png",
                              "--stats", f"{folder}/s.json"])
            if found:
                stats = json.loads(pathlib.Path(folder, "s.json").read_text())
                return stats, os.stat(f"{folder}/a.png").st_mtime - start, found[1]
            return None


def cell(value, digits=1):
    return "-" if value is None else f"{value:,.{digits}f}"


def frames(machine, programs, loaded):
    for samples, (ratio, difference) in FRAMES.items():
        samples = min(samples, 4) if machine.quick else samples
        cells = []
        for program in programs:
            found = machine.frame(program, samples)
            device, host = found or (None, None)
            more, times = found and host - device, found and host / device
            cells += [cell(device, 2), cell(host, 2), cell(more, 2), cell(times, 3)]
        goal = f"{ratio} times" if ratio else f"{difference} ms more" if difference else ""
        print(f"| {machine.processors}{', loaded' if loaded else ''} | {samples} | {' | '.join(cells)} | {goal} |",
              flush=True)


def others(machine, programs):
    size = ["--resolution", machine.size]
    by_noise = [SCENE, *size, "--adaptive", "on", "--target-error", "0.0001", "--max-spp", "16"]
    until_image, whole = lambda _, image, __: image, lambda _, __, seconds: seconds
    sampling = lambda name, factor: lambda stats, _, __: factor * stats["sampling"][name]
    works = [("16 samples by noise: sampling, ms (goal 60)", by_noise, sampling("seconds", 1e3)),
             ("the same: the whole program, s", by_noise, whole),
             ("the same: samples a pixel", by_noise, sampling("mean_samples", 1))]
    for budget in ["0.1s", "0.5s"]:
        options = [SCENE, *size, "--budget", budget]
        works += [(f"`--budget {budget}`: samples a pixel", options, sampling("mean_samples", 1)),
                  ("the same: estimated error, %", options, sampling("expected_error", 100)),
                  ("the same: sampling, s", options, sampling("seconds", 1)),
                  ("the same: the whole program, s", options, whole)]
    works += [("hello world of 1 sample: until the image is there, s (goal 0.25)", ["--spp", "1"],
               until_image),
              ("the same: the whole program, s", ["--spp", "1"], whole)]
    for name, options, value in works:
        cells = []
        for program in programs:
            found = [machine.render(program, options) for _ in range(3)]
            cells.append(cell(found[0] and statistics.median(value(*each) for each in found), 3))
        print(f"| {name} | {' | '.join(cells)} |", flush=True)
    cells = []
    for program in programs:
        found = machine.run([program, "view", "--headless", SCENE, *machine.device, *size, "--denoise", "svgf",
                             "--frames", 8 if machine.quick else 200, "--json", "-"])
        rows = {row["name"]: row["summary"]["median"] for row in json.loads(found[0])["rows"]} if found else {}
        frame = rows.get("live frame on the host")
        cells.append(cell(frame and 1e3 / frame))
    print(f"| viewer, SVGF: frames a second (goal 700) | {' | '.join(cells)} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--before")
    parser.add_argument("--threads", default=str(os.cpu_count()))
    parser.add_argument("--quick", action="store_true")
    arguments = parser.parse_args()
    programs = [program for program in [arguments.before, arguments.program] if program]
    names = ["before", "now"][-len(programs):]
    columns = " | ".join(f"{name}: device, ms | frame | more, ms | times" for name in names)
    print(f"| processors | samples | {columns} | goal |\n|{'---|' * (4 * len(programs) + 3)}")
    for processors in map(int, arguments.threads.split(",")):
        machine = Machine(arguments.quick, processors)
        for loaded in [False, True]:
            with machine.load(loaded):
                frames(machine, programs, loaded)
    machine = Machine(arguments.quick, max(map(int, arguments.threads.split(","))))
    print(f"\n| | {' | '.join(names)} |\n|{'---|' * (1 + len(programs))}")
    others(machine, programs)


if __name__ == "__main__":
    main()
