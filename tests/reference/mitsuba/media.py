"""Writes media.ron with media.vol, or renders the same scene by Mitsuba as NAME.a.npy and NAME.b.npy.

    python3 media.py write
    python3 media.py render media --spp 4096
"""
import argparse

import numpy as np

SIZE, DEPTH = 48, 24
SMOKE = dict(extinction=(0.8, 1.6, 3.2), albedo=(0.9, 0.8, 0.6), g=0.5)
CLOUD = dict(extinction=4.0, albedo=(0.95, 0.7, 0.9), g=-0.3)
CLOUD_LOW, CLOUD_HIGH = (0.3, -0.9, -0.8), (1.9, 0.5, 0.6)
BALL, RADIUS = (-1.0, -0.1, 0.2), 0.9
WHITE, LIGHT, SKY = 0.7, 9.0, 0.3


def densities():
    """A grid of 12 x 10 x 14 voxels (x, y, z): multiples of 1/64, with empty parts. Axes: z, y, x."""
    z, y, x = np.meshgrid(np.arange(14), np.arange(10), np.arange(12), indexing="ij")
    wave = np.sin(x * 0.9) * np.cos(y * 0.7 + 1) + np.sin(z * 0.8 + 0.5)
    return (np.round(np.clip(wave, 0, 1.5) / 1.5 * 64) / 64).astype(np.float32)


def write():
    grid = densities()
    with open("media.vol", "wb") as file:
        file.write(b"VOL\3" + np.array([1, *grid.shape[::-1], 1], "<i4").tobytes())
        file.write(np.array([*CLOUD_LOW, *CLOUD_HIGH], "<f4").tobytes() + grid.astype("<f4").tobytes())
    with open("media.ron", "w", encoding="ascii") as file:
        file.write(f"""// A ball of smoke and a cloud with a grid of densities, as media.py builds them. CC0-1.0.
Scene(
    version: 1,
    image: (width: {SIZE}, height: {SIZE}, samples: 256, depth: {DEPTH}),
    camera: (look_from: (0.4, 1.2, 6), look_at: (0.2, 0, 0), vertical_fov: 36),
    sky: Uniform(radiance: ({SKY}, {SKY}, {SKY})),
    media: {{
        "smoke": (extinction: {SMOKE["extinction"]}, albedo: {SMOKE["albedo"]}, anisotropy: {SMOKE["g"]}),
        "cloud": (
            extinction: {(CLOUD["extinction"],) * 3}, albedo: {CLOUD["albedo"]}, anisotropy: {CLOUD["g"]},
            grid: (file: "media.vol"),
        ),
    }},
    materials: {{
        "white": Lambertian(albedo: {(WHITE,) * 3}),
        "light": Emissive(radiance: {(LIGHT,) * 3}),
        "smoke": Interface(medium: "smoke"),
        "cloud": Interface(medium: "cloud"),
    }},
    objects: [
        Quad(corner: (-4, -1.2, 4), u: (8, 0, 0), v: (0, 0, -8), material: "white"),
        Quad(corner: (-1, 2.5, -1), u: (2, 0, 0), v: (0, 0, 2), material: "light"),
        Sphere(center: {BALL}, radius: {RADIUS}, material: "smoke"),
        Box(min: {CLOUD_LOW}, max: {CLOUD_HIGH}, material: "cloud"),
    ],
)
""")


def render(name, spp, threads):
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    import drjit as dr

    dr.set_thread_count(threads)
    T = mi.ScalarTransform4f
    rgb = lambda value: {"type": "rgb", "value": [float(x) for x in value]}
    null, size = {"type": "null"}, np.subtract(CLOUD_HIGH, CLOUD_LOW)
    unit_to_world = T().translate(list(CLOUD_LOW)).scale(list(size))
    smoke = {
        "type": "homogeneous", "sigma_t": rgb(np.divide(SMOKE["extinction"], 4)), "scale": 4, "albedo": rgb(SMOKE["albedo"]),
        "phase": {"type": "hg", "g": SMOKE["g"]},
    }
    cloud = {
        "type": "heterogeneous", "scale": CLOUD["extinction"],
        "sigma_t": {"type": "gridvolume", "grid": mi.VolumeGrid(densities()[..., None]), "raw": True,
                    "filter_type": "trilinear", "wrap_mode": "clamp", "to_world": unit_to_world},
        "albedo": {"type": "constvolume", "value": rgb(CLOUD["albedo"])},
        "phase": {"type": "hg", "g": CLOUD["g"]},
    }
    # A rectangle reaches from -1 to 1 and looks along +z.
    scene = mi.load_dict({
        "type": "scene",
        "integrator": {"type": "volpathmis", "max_depth": DEPTH, "rr_depth": 10_000},
        "sensor": {
            "type": "perspective", "fov": 36, "fov_axis": "y",
            "to_world": T().look_at(origin=[0.4, 1.2, 6], target=[0.2, 0, 0], up=[0, 1, 0]),
            "film": {"type": "hdrfilm", "width": SIZE, "height": SIZE, "rfilter": {"type": "box"},
                     "pixel_format": "rgb", "component_format": "float32"},
            "sampler": {"type": "independent"},
        },
        "sky": {"type": "constant", "radiance": rgb([SKY] * 3)},
        "floor": {"type": "rectangle", "to_world": T().translate([0, -1.2, 0]).rotate([1, 0, 0], -90).scale(4),
                  "bsdf": {"type": "diffuse", "reflectance": rgb([WHITE] * 3)}},
        "light": {"type": "rectangle", "to_world": T().translate([0, 2.5, 0]).rotate([1, 0, 0], 90),
                  "bsdf": {"type": "diffuse", "reflectance": rgb([0, 0, 0])},
                  "emitter": {"type": "area", "radiance": rgb([LIGHT] * 3)}},
        "ball": {"type": "sphere", "center": list(BALL), "radius": RADIUS, "bsdf": null, "interior": smoke},
        "cube": {"type": "cube", "to_world": unit_to_world @ T().translate([0.5, 0.5, 0.5]).scale(0.5),
                 "bsdf": null, "interior": cloud},
    })
    for half, base in (("a", 1), ("b", 1_000_001)):
        total, count, chunk = 0.0, 0, 64
        while count < spp:
            total = total + np.array(mi.render(scene, spp=chunk, seed=base + count), np.float64) * chunk
            count += chunk
        image = (total / count).astype(np.float32)
        assert np.isfinite(image).all()
        np.save(f"{name}.{half}.npy", image)
        print(f"{name}.{half}.npy {image.shape} mean {image.mean((0, 1))}", flush=True)


parser = argparse.ArgumentParser()
parser.add_argument("what", choices=["write", "render"])
parser.add_argument("name", nargs="?", default="media")
parser.add_argument("--spp", type=int, default=1024, help="samples per pixel of each of the two images")
parser.add_argument("--threads", type=int, default=1)
args = parser.parse_args()
write() if args.what == "write" else render(args.name, args.spp, args.threads)
