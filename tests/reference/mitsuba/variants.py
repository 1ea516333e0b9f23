"""Writes the scene files of the references: scenes of a modest size with features that both programs define alike."""
import os
import re

import numpy as np

here = os.path.dirname(os.path.abspath(__file__))
scenes = os.path.join(here, "..", "scenes")


def write(name, text):
    with open(os.path.join(here, name), "w", newline="\n") as file:
        file.write(text)


def variant(source, image, extra=()):
    with open(os.path.join(scenes, source)) as file:
        text = file.read()
    text, count = re.subn(r"image: \([^)]*\)", f"image: {image}", text)
    assert count == 1
    for pattern, replacement in extra:
        text, count = re.subn(pattern, replacement, text)
        assert count >= 1, pattern
    return text


write("cornell_box.ron", variant("cornell_box.ron", "(width: 128, height: 128, samples: 4096, depth: 12)"))
write("veach_mis.ron", variant("veach_mis.ron", "(width: 150, height: 100, samples: 4096, depth: 6)"))
# Silver-like indices instead of Schlick's approximation.
write("veach_mis_ior.ron", variant("veach_mis.ron", "(width: 150, height: 100, samples: 4096, depth: 6)",
      [(r"Schlick\(reflectance: \([^)]*\)\)", "Ior(eta: (0.2, 0.92, 1.1), k: (3.91, 2.45, 2.14))")]))

MATERIALS = """// Reference for rough and smooth metals and glass under an area light and a panorama. The panorama is smooth, so that how texels are
// interpolated does not matter. Made for this project; CC0-1.0.
Scene(
    version: 1,
    about: "Spheres of metal and glass.",
    image: (width: 160, height: 100, samples: 4096, depth: 12),
    camera: (look_from: (0, 3.6, 9), look_at: (0, 0.4, 0.2), vertical_fov: 24),
    sky: {sky},
    materials: {{
        "floor": Lambertian(albedo: (0.4, 0.35, 0.3)),
        "light": Emissive(radiance: (6, 5.5, 5)),
        "bulb": Emissive(radiance: (20, 24, 30)),
        "metal 1": Conductor(fresnel: Ior(eta: (1.6575, 0.8804, 0.5212), k: (9.2239, 6.2695, 4.837)), roughness: 0.15, multiple_scattering: false),
        "metal 2": Conductor(fresnel: Ior(eta: (1.6575, 0.8804, 0.5212), k: (9.2239, 6.2695, 4.837)), roughness: 0.4, multiple_scattering: false),
        "metal 3": Conductor(fresnel: Ior(eta: (1.6575, 0.8804, 0.5212), k: (9.2239, 6.2695, 4.837)), roughness: 0.7, multiple_scattering: false),
        "metal 4": Conductor(fresnel: Ior(eta: (1.6575, 0.8804, 0.5212), k: (9.2239, 6.2695, 4.837)), roughness: 1, multiple_scattering: false),
        "gold": Conductor(fresnel: Ior(eta: (0.1431, 0.375, 1.4425), k: (3.9832, 2.3857, 1.6032)), roughness: 0.25, multiple_scattering: false),
        "copper": Conductor(fresnel: Ior(eta: (0.2004, 0.924, 1.1022), k: (3.9129, 2.4528, 2.1422)), roughness: 0.5, multiple_scattering: false),
        "mirror": Metal(albedo: (0.9, 0.8, 0.7), fuzz: 0),
        "diffuse": Lambertian(albedo: (0.2, 0.4, 0.7)),
{glasses}    }},
    objects: [
        Quad(corner: (-8, 0, 8), u: (16, 0, 0), v: (0, 0, -16), material: "floor"),
        Quad(corner: (-2, 4, -3), u: (4, 0, 0), v: (0, 0, 2), material: "light"),
        Sphere(center: (3.4, 1.6, 0.5), radius: 0.15, material: "bulb"),
        Sphere(center: (-2.4, 0.5, -0.9), radius: 0.5, material: "metal 1"),
        Sphere(center: (-0.8, 0.5, -0.9), radius: 0.5, material: "metal 2"),
        Sphere(center: (0.8, 0.5, -0.9), radius: 0.5, material: "metal 3"),
        Sphere(center: (2.4, 0.5, -0.9), radius: 0.5, material: "metal 4"),
{second}    ],
)
"""
metals = """        Sphere(center: (-2.4, 0.5, 1.1), radius: 0.5, material: "gold"),
        Sphere(center: (-0.8, 0.5, 1.1), radius: 0.5, material: "copper"),
        Sphere(center: (0.8, 0.5, 1.1), radius: 0.5, material: "mirror"),
        Sphere(center: (2.4, 0.5, 1.1), radius: 0.5, material: "diffuse"),
"""
glass = """        Sphere(center: (-2.4, 0.5, 1.1), radius: 0.5, material: "glass 1"),
        Sphere(center: (-0.8, 0.5, 1.1), radius: 0.5, material: "glass 2"),
        Sphere(center: (0.8, 0.5, 1.1), radius: 0.5, material: "glass 3"),
        Sphere(center: (2.4, 0.5, 1.1), radius: 0.5, material: "glass 4"),
"""
glasses = """        "glass 1": Dielectric(ior: 1.5),
        "glass 2": RoughDielectric(ior: 1.5, roughness: 0.2, multiple_scattering: false),
        "glass 3": RoughDielectric(ior: 1.5, roughness: 0.45, multiple_scattering: false),
        "glass 4": RoughDielectric(ior: 1.5, roughness: 0.8, multiple_scattering: false),
"""
panorama = 'Image(file: "sky_smooth.pfm", scale: 1.5, rotation: 40)'
write("metals.ron", MATERIALS.format(sky=panorama, glasses="", second=metals))
write("glass.ron", MATERIALS.format(sky=panorama, glasses=glasses, second=glass))
# Only two glass boundaries, so that no lights hide the distribution.
write("glass_sky.ron", f"""// Reference for glass, smooth and rough, under a panorama alone. Made for this project; CC0-1.0.
Scene(
    version: 1,
    about: "Spheres of glass in a panorama.",
    image: (width: 160, height: 60, samples: 4096, depth: 24),
    camera: (look_from: (0, 0, 12), look_at: (0, 0, 0), vertical_fov: 7),
    sky: {panorama},
    materials: {{
{glasses}    }},
    objects: [
        Sphere(center: (-1.5, 0, 0), radius: 0.45, material: "glass 1"),
        Sphere(center: (-0.5, 0, 0), radius: 0.45, material: "glass 2"),
        Sphere(center: (0.5, 0, 0), radius: 0.45, material: "glass 3"),
        Sphere(center: (1.5, 0, 0), radius: 0.45, material: "glass 4"),
    ],
)
""")

write("lights.ron", """// Reference for light shapes without and with extent and a gradient sky on diffuse surfaces. Made for this project; CC0-1.0.
Scene(
    version: 1,
    about: "Point, directional, disc and sphere lights.",
    image: (width: 144, height: 96, samples: 2048, depth: 6),
    camera: (look_from: (1, 3.5, 7), look_at: (0, 0.6, 0), vertical_fov: 36),
    sky: Gradient(bottom: (0.05, 0.1, 0.02), top: (0.05, 0.1, 0.4)),
    materials: {
        "floor": Lambertian(albedo: (0.5, 0.5, 0.5)),
        "red": Lambertian(albedo: (0.7, 0.2, 0.2)),
        "disc": Emissive(radiance: (8, 6, 2)),
        "bulb": Emissive(radiance: (5, 20, 30)),
    },
    objects: [
        Plane(point: (0, 0, 0), normal: (0, 1, 0), material: "floor"),
        Sphere(center: (-1.2, 0.7, 0), radius: 0.7, material: "red"),
        Sphere(center: (0.6, 0.5, 0.8), radius: 0.5, material: "floor"),
        Quad(corner: (0.8, 0, -1.4), u: (1.4, 0, 0.5), v: (0.2, 1.6, -0.3), material: "red"),
        Disc(center: (-2.6, 1.6, -0.6), normal: (1, -0.5, 0.4), radius: 0.5, material: "disc"),
        Disc(center: (-0.2, 1.2, -1.8), normal: (0.1, 0.2, 1), radius: 0.6, material: "floor"),
        Sphere(center: (2.3, 0.3, 1.2), radius: 0.2, material: "bulb"),
    ],
    lights: [
        Point(position: (0, 2.5, 1.5), intensity: (2, 1.5, 1)),
        Directional(direction: (-1, -2, -0.7), irradiance: (0.4, 0.6, 0.8)),
    ],
)
""")

# A sky with a broad sun (sharpness 40: 13 degrees at half height). With the middle column ahead, it is red to the right and green
# above.
h, w = 128, 256
theta = (np.arange(h) + 0.5) / h * np.pi
phi = ((np.arange(w) + 0.5) / w - 0.5) * 2 * np.pi  # 0 in the middle, growing to the right
x = np.sin(theta)[:, None] * np.sin(phi)[None, :]
y = np.cos(theta)[:, None] * np.ones(w)[None, :]
z = -np.sin(theta)[:, None] * np.cos(phi)[None, :]
sun = np.array([-0.5, 0.6, 0.4])
sun /= np.linalg.norm(sun)
lobe = np.exp(40 * (x * sun[0] + y * sun[1] + z * sun[2] - 1))
sky = np.stack([0.3 + 0.2 * x, 0.35 + 0.15 * y, 0.45 + 0.1 * z], -1) + lobe[..., None] * np.array([12.0, 11.0, 9.0])
with open(os.path.join(here, "sky_smooth.pfm"), "wb") as file:
    file.write(b"PF\n%d %d\n-1.0\n" % (w, h) + sky[::-1].astype("<f4").tobytes())
