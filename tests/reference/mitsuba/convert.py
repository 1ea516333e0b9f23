"""Builds a Mitsuba scene from a scene file: the materials, shapes and lights that both programs define alike.

It shares no code with Trisect, on purpose: it has its own parser and conventions, checked against Mitsuba's documentation
and by probes.
"""
import math
import os

import mitsuba as mi
import numpy as np

import ron


def rgb(value):
    return {"type": "rgb", "value": [float(v) for v in value]}


def matrix(x, y, z, origin):
    m = np.eye(4)
    for i, column in enumerate((x, y, z, origin)):
        m[:3, i] = column
    return mi.ScalarTransform4f(m)


def frame(normal):
    n = np.array(normal, float) / np.linalg.norm(normal)
    t = np.cross(n, [1, 0, 0] if abs(n[0]) < 0.9 else [0, 1, 0])
    t /= np.linalg.norm(t)
    return t, np.cross(n, t), n


def bsdf(material, custom):
    kind, f = material
    if kind == "Lambertian":
        if "texture" in f:
            raise ValueError("a texture")
        return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": rgb(f["albedo"])}}
    if kind == "Metal" and f.get("fuzz", 0) == 0:
        # Without Fresnel: k = 0 and eta = 0 reflect everything, multiplied by the albedo.
        return {"type": "twosided", "bsdf": {"type": "conductor", "material": "none", "specular_reflectance": rgb(f["albedo"])}}
    if kind == "Dielectric":
        return {"type": "dielectric", "int_ior": f["ior"], "ext_ior": 1.0}
    if kind == "RoughDielectric" and custom is not None:
        return {"type": "trisect_dielectric", "alpha": f["roughness"] ** 2, "ior": f["ior"], "correlated": custom == "correlated"}
    if kind == "RoughDielectric":
        return {"type": "roughdielectric", "distribution": "ggx", "alpha": f["roughness"] ** 2, "int_ior": f["ior"],
                "ext_ior": 1.0, "sample_visible": True}
    if kind == "Conductor":
        model, values = f["fresnel"]
        alpha = f["roughness"] ** 2
        if model == "Ior" and custom is None:
            return {"type": "twosided", "bsdf": {"type": "roughconductor", "distribution": "ggx", "alpha": alpha,
                    "sample_visible": True, "eta": rgb(values["eta"]), "k": rgb(values["k"])}}
        result = {"type": "trisect_conductor", "alpha": alpha, "correlated": custom == "correlated", "schlick": model == "Schlick"}
        for name, triple in (("eta", values.get("eta")), ("k", values.get("k")), ("r0", values.get("reflectance"))):
            for c, v in zip("rgb", triple or ()):
                result[f"{name}_{c}"] = v
        return result
    if kind == "Emissive":
        return {"type": "diffuse", "reflectance": 0.0}
    if kind == "Interface":
        return {"type": "null"}
    raise ValueError(f"no twin for {kind}")


def placement(steps):
    """Returns the matrix of a list of transforms, of which the first applies first."""
    t = mi.ScalarTransform4f()
    result = t
    for kind, values in steps:
        if kind == "Translate":
            step = t.translate(values[0])
        elif kind == "RotateY":
            step = t.rotate([0, 1, 0], values[0])
        else:
            raise ValueError(kind)
        result = step @ result
    return result


def medium(f):
    """Returns a homogeneous medium with isotropic scattering."""
    if set(f) - {"extinction", "albedo"}:
        raise ValueError(f"a medium with {set(f)}")
    return {"type": "homogeneous", "sigma_t": rgb(f["extinction"]), "albedo": rgb(f.get("albedo", (0, 0, 0)))}


def panorama(image, scale):
    """Resamples a Trisect environment map (bilinear between texel centres, clamped at the poles) as a finer one of Mitsuba, whose
    rows begin at the poles."""
    h, w, _ = image.shape
    height, width = 1025, 2048
    v = np.arange(height) / (height - 1) * h - 0.5
    u = (np.arange(width) + 0.5) / width * w - 0.5
    y0 = np.floor(v).astype(int)
    x0 = np.floor(u).astype(int)
    fy, fx = (v - y0)[:, None, None], (u - x0)[None, :, None]
    row = lambda y: np.clip(y, 0, h - 1)
    get = lambda y, x: image[row(y)][:, x % w]
    result = (get(y0, x0) * (1 - fx) + get(y0, x0 + 1) * fx) * (1 - fy) + (get(y0 + 1, x0) * (1 - fx) + get(y0 + 1, x0 + 1) * fx) * fy
    return (result * scale).astype(np.float32)


def build(path, custom=None, width=None, height=None, depth=None, sampler="independent"):
    """Builds the scene. `custom`: None takes Mitsuba's rough metal and glass, "separable" or "correlated" those of bsdf.py."""
    with open(path) as file:
        scene = ron.parse(file.read())
    image, camera = scene["image"], scene["camera"]
    width, height = int(width or image["width"]), int(height or image["height"])
    depth = int(depth or image.get("depth", 50))
    d = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": depth, "rr_depth": 1000000},
        "sensor": {
            "type": "perspective", "fov_axis": "y", "fov": camera["vertical_fov"], "near_clip": 1e-3, "far_clip": 1e6,
            "to_world": mi.ScalarTransform4f().look_at(camera["look_from"], camera["look_at"], camera.get("up", [0, 1, 0])),
            "film": {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}, "pixel_format": "rgb",
                     "component_format": "float32", "sample_border": False},
            "sampler": {"type": sampler},
        },
    }
    if camera.get("defocus_angle", 0) != 0:
        focus = camera["focus_distance"]
        d["sensor"]["type"] = "thinlens"
        d["sensor"]["focus_distance"] = focus
        d["sensor"]["aperture_radius"] = focus * math.tan(math.radians(camera["defocus_angle"]) / 2)
    kind, f = scene.get("sky", ("Black", {}))
    if kind == "Uniform":
        d["sky"] = {"type": "constant", "radiance": rgb(f["radiance"])}
    elif kind == "Gradient":
        y = np.cos(np.arange(513) / 512 * math.pi)[:, None, None]
        bottom, top = np.array(f["bottom"]), np.array(f["top"])
        data = np.broadcast_to(bottom + (top - bottom) * (y + 1) / 2, (513, 16, 3)).astype(np.float32)
        d["sky"] = {"type": "envmap", "bitmap": mi.Bitmap(np.ascontiguousarray(data))}
    elif kind == "Image":
        file = os.path.join(os.path.dirname(path), f["file"])
        data = np.array(mi.Bitmap(file).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))
        data = panorama(data, f.get("scale", 1))
        # Mitsuba has its middle column at +z, Trisect at -z; both turn to the right with u.
        turn = mi.ScalarTransform4f().rotate([0, 1, 0], 180 + f.get("rotation", 0))
        d["sky"] = {"type": "envmap", "bitmap": mi.Bitmap(data), "to_world": turn}
    elif kind != "Black":
        raise ValueError(kind)
    for i, (kind, f) in enumerate(scene["objects"]):
        material = scene["materials"][f["material"]]
        if kind == "Sphere":
            shape = {"type": "sphere", "center": f["center"], "radius": f["radius"]}
        elif kind == "Quad":
            corner, u, v = (np.array(f[k], float) for k in ("corner", "u", "v"))
            n = np.cross(u, v)
            if abs(u @ v) > 1e-9 * np.linalg.norm(u) * np.linalg.norm(v) and material[0] == "Emissive":
                raise ValueError("a sheared light")
            shape = {"type": "rectangle", "to_world": matrix(u / 2, v / 2, n / np.linalg.norm(n), corner + u / 2 + v / 2)}
        elif kind == "Disc":
            t, s, n = frame(f["normal"])
            shape = {"type": "disk", "to_world": matrix(t * f["radius"], s * f["radius"], n, f["center"])}
        elif kind == "Box":
            low, high = np.array(f["min"]), np.array(f["max"])
            place = placement(f.get("transform", [])).translate(list((low + high) / 2)).scale(list((high - low) / 2))
            shape = {"type": "cube", "to_world": place}
        elif kind == "Plane":
            t, s, n = frame(f["normal"])
            shape = {"type": "rectangle", "to_world": matrix(t * 1e4, s * 1e4, n, f["point"])}
        else:
            raise ValueError(kind)
        shape["bsdf"] = bsdf(material, custom)
        if material[0] == "Interface":
            shape["interior"] = medium(scene["media"][material[1]["medium"]])
        if material[0] == "Emissive":
            if material[1].get("two_sided"):
                raise ValueError("a light with two sides")
            shape["emitter"] = {"type": "area", "radiance": rgb(material[1]["radiance"])}
        d[f"object_{i:05}"] = shape
    for i, (kind, f) in enumerate(scene.get("lights", [])):
        if kind == "Point":
            light = {"type": "point", "position": f["position"], "intensity": rgb(f["intensity"])}
        elif kind == "Directional":
            light = {"type": "directional", "direction": f["direction"], "irradiance": rgb(f["irradiance"])}
        else:
            raise ValueError(kind)  # Mitsuba's spot falls off otherwise
        d[f"light_{i}"] = light
    return mi.load_dict(d)
