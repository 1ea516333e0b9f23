"""Compares the noise of Trisect, Mitsuba 3.9.1 and Blender's Cycles 4.5 at equal time, on the same threads of one machine,
or on one GPU by CUDA (`--device cuda`: without Cycles), one program after the other. Denoisers are off.

    python3 race.py ../../../target/release/trisect --mitsuba MITSUBA/bin/python --cycles BPY/bin/python

MITSUBA and BPY are virtual environments: `pip install mitsuba==3.9.1 numpy`, and `pip install bpy==4.5.*` for Python 3.11.
Prints a table for each scene: samples a pixel, seconds, relMSE, its ratio to the best of the other programs, and how far
images are from Trisect's reference.

- relMSE: variance over the seeds of a setting, scaled to exactly the time, over squared reference + 0.01; means of pixels
  and channels. So the error is that of noise alone, whatever a program models otherwise.
- apart: how far the mean of the images is from the reference, relative, without what noise explains: root mean square of
  8 by 8 parts. A program that leaves light out shows here.
- The scene files are those of scenes/, and those of the folder beside. What the programs do not define alike is replaced:
  fuzzy metals by mirrors, rough ones by diffuse surfaces, Schlick's approximation by Fresnel's equations. In many_lights
  glass is diffuse, too, and the smoke of cornell_smoke is half a unit above the floor that it touches.
"""
import argparse
import json
import os
import re
import subprocess
import tempfile

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
SCENES = {  # file, width, height
    "cornell_box": ("../../../scenes/cornell_box.ron", 256, 256),
    "rtiow_final": ("../../../scenes/rtiow_final.ron", 400, 225),
    "door_slit": ("../../../scenes/door_slit.ron", 320, 240),
    "many_lights": ("../../../scenes/many_lights.ron", 400, 225),
    "cornell_smoke": ("../../../scenes/cornell_smoke.ron", 256, 256),
    "room_morning": ("scenes/room_morning.ron", 400, 225),
    "room_evening": ("scenes/room_evening.ron", 400, 225),
    "caustic": ("scenes/caustic.ron", 400, 225),
}
MITSUBA = ["roulette 5", "roulette 5, multijitter", "no roulette"]
CYCLES = ["light tree", "no light tree"]
TRISECT = {"--budget": ["--budget", "{seconds}s", "--denoise", "off"], "--spp": ["--spp", "{spp}"]}


def pfm(path):
    with open(path, "rb") as file:
        assert file.readline().strip() == b"PF"
        width, height = map(int, file.readline().split())
        little = float(file.readline()) < 0
        data = np.frombuffer(file.read(), "<f4" if little else ">f4").reshape(height, width, 3)
    return np.flipud(data).astype(np.float64)


def prepare(source, target, width, height):
    """Writes a scene file with the size and with what all three programs define alike."""
    with open(source) as file:
        text = file.read()
    text = re.sub(r"fuzz: [0-9.e-]+", "fuzz: 0", text).replace("fresnel: Schlick,", "fresnel: Exact,")
    text = re.sub(r"Conductor\(fresnel: Schlick\(reflectance: (\([^)]*\))\), roughness: [0-9.]+\)", r"Lambertian(albedo: \1)", text)
    if "many_lights" in source:
        # Reflections of a thousand small lamps are rare bright samples, which hide how lamps are chosen.
        text = re.sub(r"Dielectric\(ior: 1.5\)", "Lambertian(albedo: (0.7, 0.7, 0.7))", text)
    # Smoke that touches the floor in a plane is found or not as rays round.
    text = re.sub(r"Translate\(\((\d+), 0, (\d+)\)\)\], material: \"(tall|short) block\"", r'Translate((\1, 0.5, \2))], material: "\3 block"', text)
    text = re.sub(r"width: \d+, height: \d+", f"width: {width}, height: {height}", text)
    with open(target, "w") as file:
        file.write(text)


def blocks(image):
    """Returns means of 8 by 8 parts of the image, over the channels, too."""
    rows = np.array_split(image.mean(2), 8)
    return np.array([[part.mean() for part in np.array_split(row, 8, axis=1)] for row in rows])


def row(label, images, lines, reference, seconds):
    """Returns a table's row: the noise of the images of several seeds, and their mean's distance from the reference."""
    variance = np.var(images, axis=0, ddof=1) * np.mean([line["seconds"] for line in lines]) / seconds
    error = float(np.mean(variance / (reference**2 + 0.01)))
    parts, want = np.array([blocks(image) for image in images]), blocks(reference)
    square = ((parts.mean(0) - want) ** 2 - parts.var(0, ddof=1) / len(images)) / (want**2 + 1e-4)
    return {"label": label, "spp": np.mean([line["spp"] for line in lines]), "seconds": np.mean([line["seconds"] for line in lines]),
            "error": error, "apart": max(float(np.mean(square)), 0.0) ** 0.5}


def race(name, args, folder):
    file, width, height = SCENES[name]
    scene = os.path.join(folder, f"{name}.ron")
    width, height = width * args.scale, height * args.scale
    prepare(os.path.join(HERE, file), scene, width, height)
    common = ["--seconds", str(args.seconds), "--seeds", str(args.seeds), "--threads", str(args.threads)]

    def peer(label, python, script, setting):
        out = os.path.join(folder, "image")
        command = [python, os.path.join(HERE, script), scene, setting, *common, "--device", args.device, "--out", out]
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        if done.returncode:
            raise SystemExit(f"{' '.join(command)}\n{done.stderr[-2000:]}")
        lines = [json.loads(line) for line in re.findall(r"{.*}", done.stdout)]  # among what the programs print
        images = [np.load(f"{out}.{seed}.npy") for seed in range(args.seeds)]
        return row(f"{label}, {setting}", images, lines, reference, args.seconds)

    def trisect(*more):
        stats, image = os.path.join(folder, "stats.json"), os.path.join(folder, "image.pfm")
        subprocess.run([args.trisect, "render", scene, *map(str, more), "--backend", args.device, "--threads", str(args.threads), "-q",
                        "--stats", stats, "-o", image], check=True)
        with open(stats) as file:
            return pfm(image), json.load(file)

    def own(label, options):
        spp = 4
        while "{spp}" in options:
            took = trisect("--spp", spp)[1]["phases"]["render_seconds"]
            if took > 0.8 * args.seconds:
                break
            spp = max(spp + 1, int(spp * min(0.95 * args.seconds / max(took, 1e-3), 8)))
        images, lines = [], []
        for seed in range(args.seeds):
            image, stats = trisect(*(each.format(seconds=args.seconds, spp=spp) for each in options), "--seed", 100 + seed)
            sampling = stats["sampling"]
            lines.append({"spp": sampling["mean_samples"], "seconds": sampling["seconds"]} if sampling
                         else {"spp": spp, "seconds": stats["phases"]["render_seconds"]})
            images.append(image)
        return row(f"Trisect, {label}", images, lines, reference, args.seconds)

    reference, _ = trisect("--budget", f"{args.reference}s", "--denoise", "off", "--seed", 77)
    rows = []
    if args.mitsuba:
        rows += [peer("Mitsuba", args.mitsuba, "with_mitsuba.py", setting) for setting in MITSUBA]
    if args.cycles:
        more = ["light tree, shadow caustics"] if name == "caustic" else []
        rows += [peer("Cycles", args.cycles, "with_cycles.py", setting) for setting in CYCLES + more]
    best = min([each["error"] for each in rows], default=float("nan"))
    rows += [own(label, options) for label, options in TRISECT.items()]
    print(f"\n{name}, {width}x{height}, {args.device}, {args.threads} threads, {args.seconds:g} s, {args.seeds} seeds\n")
    print("| | samples a pixel | seconds | relMSE | of the best other | apart |\n|---|---|---|---|---|---|")
    for each in rows:
        print(f"| {each['label']} | {each['spp']:.0f} | {each['seconds']:.2f} | {each['error']:.2e} | {each['error'] / best:.2f} "
              f"| {100 * each['apart']:.2f} % |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("trisect")
    parser.add_argument("--mitsuba", metavar="PYTHON", help="a Python with mitsuba")
    parser.add_argument("--cycles", metavar="PYTHON", help="a Python with bpy")
    parser.add_argument("--scenes", nargs="*", choices=SCENES, default=list(SCENES))
    parser.add_argument("--seconds", type=float, default=5)
    parser.add_argument("--reference", type=float, default=40, help="seconds of Trisect's reference")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--device", choices=["cpu", "cuda"], default="cpu")
    parser.add_argument("--scale", type=int, default=1, help="factor on the width and height of images")
    args = parser.parse_args()
    if args.cycles and args.device != "cpu":
        parser.error("--cycles is for --device cpu")
    with tempfile.TemporaryDirectory() as folder:
        for name in args.scenes:
            race(name, args, folder)


if __name__ == "__main__":
    main()
