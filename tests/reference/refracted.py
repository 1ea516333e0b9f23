#!/usr/bin/env python3
"""Measures light through smooth glass: a ball, a slab and a pane between a floor and a point light or a sun.

    tests/reference/refracted.py target/release/trisect [--seconds 10] [--reference 16] [--spheres 2048] [--threads N]

Prints a row for each of six scenes: the image's estimated error after --seconds, its error against a reference of
--reference times as long (the root of relMSE, as estimated), the rays of a sample, and the mean beside that of the same
scene whose lamp is a small sphere, found by scattered rays alone (--spheres samples at half the size; with its standard
error by blocks of 160 pixels; 0 leaves it out).
"""
import argparse
import json
import pathlib
import subprocess
import tempfile

import numpy as np

SCENE = """Scene(
    version: 1,
    image: (width: {width}, height: {height}, depth: 8),
    camera: (look_from: (0, 5, 11), look_at: (0, 1.2, 0), vertical_fov: 32),
    sky: Black,
    materials: {{
        "floor": Lambertian(albedo: (0.6, 0.6, 0.6)),
        "glass": Dielectric(ior: 1.5),
        "pane": MetallicRoughness(base_color: (0.9, 0.9, 0.9), metallic: 0, roughness: 0, transmission: 0.8),
        "lamp": Emissive(radiance: ({radiance}, {radiance}, {radiance})),
    }},
    objects: [Disc(center: (0, 0, 0), normal: (0, 1, 0), radius: 12, material: "floor"), {objects}],
    {lights}
)
"""
GLASS = {
    "ball": 'Sphere(center: (0, 2.5, 0), radius: 1, material: "glass")',
    "slab": 'Box(min: (-4, 1, -4), max: (4, 1.5, 4), material: "glass")',
    "pane": 'Quad(corner: (-4, 1, -4), u: (8, 0, 0), v: (0, 0, 8), material: "pane")',
}
POINT, INTENSITY, SUN, IRRADIANCE = (0, 6.5, 0), 120.0, (0.1, 1.0, 0.05), 3.0
RADIUS, FAR = 0.2, 1000.0
# Radiance above that of a floor with caustics, and below that of the sphere in glass, at 4 % of its own.
MIRRORED = 20


def scene(glass, light, size, as_sphere):
    """Returns the text of a scene whose light has no extent, or is a small sphere of the same power."""
    width, height = size
    objects, lights, radiance = GLASS[glass], "", 1.0
    if light == "point" and not as_sphere:
        lights = f"lights: [Point(position: {POINT}, intensity: ({INTENSITY}, {INTENSITY}, {INTENSITY}))],"
    elif light == "sun" and not as_sphere:
        lights = f"lights: [Directional(direction: {tuple(-c for c in SUN)}, irradiance: ({IRRADIANCE}, {IRRADIANCE}, {IRRADIANCE}))],"
    elif light == "point":
        radiance = INTENSITY / (np.pi * RADIUS**2)
        objects += f', Sphere(center: {POINT}, radius: {RADIUS}, material: "lamp")'
    else:
        # As wide as the point's sphere is from the ball, and far away.
        radius = FAR * RADIUS / 4
        radiance = IRRADIANCE * FAR**2 / (np.pi * radius**2)
        center = tuple(float(c) for c in FAR * np.array(SUN) / np.linalg.norm(SUN))
        objects += f', Sphere(center: {center}, radius: {radius}, material: "lamp")'
    return SCENE.format(width=width, height=height, objects=objects, lights=lights, radiance=radiance)


def read_pfm(path):
    data = pathlib.Path(path).read_bytes()
    kind, size, scale, pixels = data.split(b"\n", 3)
    width, height = map(int, size.split())
    assert kind == b"PF" and float(scale) < 0
    return np.frombuffer(pixels, "<f4").reshape(height, width, 3)[::-1].astype(float)


class Program:
    def __init__(self, args, folder):
        self.args, self.folder = args, pathlib.Path(folder)

    def render(self, text, options):
        """Returns the image, shape (height, width, 3), and the statistics."""
        (self.folder / "a.ron").write_text(text)
        threads = ["--threads", str(self.args.threads)] if self.args.threads else []
        command = [self.args.program, "render", str(self.folder / "a.ron"), "--backend", "cpu", "-q", *threads, *options,
                   "-o", str(self.folder / "a.pfm"), "--stats", str(self.folder / "a.json")]
        subprocess.run(command, check=True, stderr=subprocess.DEVNULL)
        return read_pfm(self.folder / "a.pfm"), json.loads((self.folder / "a.json").read_text())


def blocks(image):
    """Returns the means of blocks of 16 x 10 pixels."""
    height, width = image.shape[0] // 10 * 10, image.shape[1] // 16 * 16
    return image[:height, :width].mean(2).reshape(height // 10, 10, width // 16, 16).mean((1, 3))


def row(program, glass, light):
    args = program.args
    text = scene(glass, light, (320, 180), False)
    image, stats = program.render(text, ["--budget", f"{args.seconds}s", "--denoise", "off"])
    reference, _ = program.render(text, ["--budget", f"{args.seconds * args.reference}s", "--denoise", "off", "--seed", "7"])
    difference = (image - reference) ** 2 / (reference**2 + 0.01)
    error = 100 * np.sqrt(difference.mean())
    ratio = "-"
    if args.spheres:
        small, wide = (program.render(scene(glass, light, (160, 90), as_sphere), options)[0] for as_sphere, options in [
            (False, ["--spp", str(args.spheres // 4), "--seed", "3"]),
            (True, ["--spp", str(args.spheres), "--light-sampling", "off", "--seed", "4"])])
        # Glass also mirrors the sphere, which no connection to a point finds.
        mirrored = wide.max(2) > MIRRORED
        for axis in [0, 1]:
            mirrored |= np.roll(mirrored, 1, axis) | np.roll(mirrored, -1, axis)
        wide[mirrored] = small[mirrored] = 0
        deviations = blocks(wide) - blocks(small)
        deviation = deviations.std() / np.sqrt(deviations.size) / blocks(small).mean()
        ratio = f"{small.mean() / wide.mean():.3f} ± {deviation:.3f}"
    sampling = stats["sampling"]
    rays = stats["segments"] / stats["samples"]
    print(f"| {glass}, {light} | {100 * sampling['expected_error']:.2f} | {error:.2f} | {sampling['mean_samples']:.0f} "
          f"| {rays:.1f} | {ratio} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--reference", type=float, default=16)
    parser.add_argument("--spheres", type=int, default=2048)
    parser.add_argument("--threads", type=int)
    parser.add_argument("--scenes", nargs="*", help="such as ball,point (default: all six)")
    args = parser.parse_args()
    print("| scene | estimated error, % | error, % | samples a pixel | rays | ratio of means |\n|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for glass in GLASS:
            for light in ["point", "sun"]:
                if not args.scenes or f"{glass},{light}" in args.scenes:
                    row(Program(args, folder), glass, light)


if __name__ == "__main__":
    main()
