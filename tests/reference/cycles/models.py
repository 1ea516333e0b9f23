#!/usr/bin/env python3
"""Writes small glTF models, one feature or pair of features each, to the current folder.

Each has a square or a ball around the origin, and a quad that emits from both sides."""

import json
import math
import struct
import zlib

FLOAT, UINT, BYTE, SHORT = (5126, "f"), (5125, "I"), (5121, "B"), (5123, "H")


def png(size, pixels):
    """Returns a square PNG file of 8-bit RGB pixels, row by row from the top."""
    rows = b"".join(b"\0" + bytes(pixels[y * size * 3 : (y + 1) * size * 3]) for y in range(size))
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    header = struct.pack(">IIBBBBB", size, size, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


class Model:
    """A .glb file under construction, with the light in it."""

    def __init__(self):
        self.data = b""
        self.root = {
            "asset": {"version": "2.0"},
            "extensionsUsed": ["KHR_materials_emissive_strength"],
            "samplers": [{"magFilter": 9729, "minFilter": 9729}],
            "scenes": [{"nodes": []}],
            "scene": 0,
        }
        light = {
            "name": "light",
            "doubleSided": True,
            "emissiveFactor": [1, 1, 1],
            "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0},
            "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 8}},
        }
        corners = [[-3, 1, 1], [-3, 3, 1], [-2, 3, 3], [-2, 1, 3]]
        self.mesh({"POSITION": self.accessor(corners)}, [0, 3, 2, 0, 2, 1], self.add("materials", light))

    def add(self, kind, value):
        members = self.root.setdefault(kind, [])
        members.append(value)
        return len(members) - 1

    def view(self, data):
        self.data += b"\0" * (-len(self.data) % 4)
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)}
        self.data += data
        return self.add("bufferViews", view)

    def accessor(self, rows, component=FLOAT, normalized=True):
        code, letter = component
        width = len(rows[0]) if isinstance(rows[0], list) else 1
        numbers = [number for row in rows for number in (row if width > 1 else [row])]
        view = self.view(struct.pack(f"<{len(numbers)}{letter}", *numbers))
        kind = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}[width]
        accessor = {"bufferView": view, "componentType": code, "count": len(rows), "type": kind}
        if component in (BYTE, SHORT) and normalized:
            accessor["normalized"] = True
        if kind in ("SCALAR", "VEC3") and component == FLOAT:
            rows = rows if kind == "VEC3" else [[row] for row in rows]
            accessor["min"], accessor["max"] = ([f(row[i] for row in rows) for i in range(len(rows[0]))] for f in (min, max))
        return self.add("accessors", accessor)

    def texture(self, file):
        image = self.add("images", {"bufferView": self.view(file), "mimeType": "image/png"})
        return self.add("textures", {"source": image, "sampler": 0})

    def mesh(self, attributes, indices, material, node=None):
        part = {"attributes": attributes, "indices": self.accessor(indices, UINT), "material": material}
        mesh = self.add("meshes", {"primitives": [part]})
        self.root["scenes"][0]["nodes"].append(self.add("nodes", {"mesh": mesh, **(node or {})}))

    def write(self, path):
        data = self.data + b"\0" * (-len(self.data) % 4)
        text = json.dumps({**self.root, "buffers": [{"byteLength": len(self.data)}]}).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
        with open(path, "wb") as file:
            file.write(struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks)


def bumps(waves, size=64, slope=0.6):
    """Returns a normal map of waves along both axes."""
    pixels = []
    for i in range(size * size):
        u, v = (i % size + 0.5) / size, (i // size + 0.5) / size
        x, y = slope * math.sin(2 * math.pi * waves * u), slope * math.cos(2 * math.pi * waves * v)
        length = math.sqrt(x * x + y * y + 1)
        pixels += [round((c / length * 0.5 + 0.5) * 255) for c in (x, y, 1)]
    return png(size, pixels)


def checker(size=64):
    colours = ([230, 60, 40], [240, 240, 230])
    return png(size, [c for i in range(size * size) for c in colours[(i % size // 8 + i // size // 8) % 2]])


def square():
    """Returns positions, normals, texture coordinates and triangles."""
    positions = [[-1.2, -1.2, 0], [1.2, -1.2, 0], [1.2, 1.2, 0], [-1.2, 1.2, 0]]
    return positions, [[0, 0, 1]] * 4, [[0, 1], [1, 1], [1, 0], [0, 0]], [0, 1, 2, 0, 2, 3]


def ball(rows=24):
    columns = 2 * rows
    normals, uvs, triangles = [], [], []
    for j in range(rows + 1):
        for i in range(columns + 1):
            polar, around = math.pi * j / rows, math.pi * i / rows
            sine = math.sin(polar)
            normals.append([sine * math.cos(around), math.cos(polar), -sine * math.sin(around)])
            uvs.append([2 * i / columns, j / rows])
    for j in range(rows):
        for i in range(columns):
            a = j * (columns + 1) + i
            b, c, d = a + columns + 1, a + columns + 2, a + 1
            triangles += ([a, b, c] if j < rows - 1 else []) + ([a, c, d] if j > 0 else [])
    return normals, normals, uvs, triangles


def pbr(roughness, metallic=0, colour=(0.8, 0.7, 0.5)):
    return {"baseColorFactor": [*colour, 1], "metallicFactor": metallic, "roughnessFactor": roughness}


def mapped(path, shape, roughness, metallic=0, scale=1.0, waves=4, node=None, turned=False, tangents=None):
    """Writes a model with a normal map; `scale` 0 is without one, but for rounding."""
    model = Model()
    positions, normals, uvs, triangles = shape
    material = {"pbrMetallicRoughness": pbr(roughness, metallic)}
    if scale is not None:
        material["normalTexture"] = {"index": model.texture(bumps(waves)), "scale": scale}
    attributes = {
        "POSITION": model.accessor(positions),
        "NORMAL": model.accessor(normals),
        "TEXCOORD_0": model.accessor([[v, 1 - u] for u, v in uvs] if turned else uvs),
    }
    if tangents:
        attributes["TANGENT"] = model.accessor(tangents)
    model.mesh(attributes, triangles, model.add("materials", material), node)
    model.write(path)


def coloured(path, encode, component):
    model = Model()
    positions, normals, _, triangles = ball()
    colours = [encode([0.5 + 0.5 * x for x in normal]) for normal in normals]
    attributes = {
        "POSITION": model.accessor(positions),
        "NORMAL": model.accessor(normals),
        "COLOR_0": model.accessor(colours, component),
    }
    material = {"pbrMetallicRoughness": pbr(0.6, colour=(0.9, 0.8, 1))}
    model.mesh(attributes, triangles, model.add("materials", material))
    model.write(path)


def two_sets(path):
    model = Model()
    positions, normals, uvs, triangles = square()
    material = {
        "normalTexture": {"index": model.texture(bumps(3)), "texCoord": 0},
        "pbrMetallicRoughness": {
            **pbr(0.7, colour=(1, 1, 1)),
            "baseColorTexture": {"index": model.texture(checker()), "texCoord": 1},
        },
    }
    attributes = {
        "POSITION": model.accessor(positions),
        "NORMAL": model.accessor(normals),
        "TEXCOORD_0": model.accessor(uvs),
        "TEXCOORD_1": model.accessor([[0.5 * u + 0.25 * v, 1.5 * v - 0.3 * u] for u, v in uvs]),
    }
    model.mesh(attributes, triangles, model.add("materials", material))
    model.write(path)


def animate(model, node, path, times, values, interpolation="LINEAR"):
    sampler = {"input": model.accessor(times), "output": model.accessor(values), "interpolation": interpolation}
    channel = {"sampler": 0, "target": {"node": node, "path": path}}
    model.add("animations", {"name": "go", "samplers": [sampler], "channels": [channel]})


def turned(degrees):
    """Returns the rotation about z as a quaternion."""
    half = math.radians(degrees) / 2
    return [0, 0, math.sin(half), math.cos(half)]


def moved(path, key, values, interpolation="LINEAR"):
    """Writes a square that an animation moves."""
    model = Model()
    positions, normals, _, triangles = square()
    positions = [[0.6 * x, 0.4 * y, z] for x, y, z in positions]
    attributes = {"POSITION": model.accessor(positions), "NORMAL": model.accessor(normals)}
    model.mesh(attributes, triangles, model.add("materials", {"pbrMetallicRoughness": pbr(0.6)}))
    animate(model, 1, key, [0, 1, 2], values, interpolation)
    model.write(path)


def skinned(path, own=None):
    """Writes a bar of two joints, the upper of which an animation turns; its node has a transform
    of its own, which must not matter."""
    model = Model()
    positions, normals, _, triangles = ball()
    positions = [[0.5 * x, 1.2 * y, 0.5 * z] for x, y, z in positions]
    normals = [[x / 0.5, y / 1.2, z / 0.5] for x, y, z in normals]
    length = lambda v: math.sqrt(sum(x * x for x in v))
    normals = [[x / length(v) for x in v] for v in normals]
    upper = [min(max(0.5 + 1.2 * y, 0), 1) for _, y, _ in positions]
    attributes = {
        "POSITION": model.accessor(positions),
        "NORMAL": model.accessor(normals),
        "JOINTS_0": model.accessor([[0, 1, 0, 0]] * len(positions), BYTE, False),
        "WEIGHTS_0": model.accessor([[1 - w, w, 0, 0] for w in upper]),
    }
    material = model.add("materials", {"pbrMetallicRoughness": pbr(0.6)})
    model.mesh(attributes, triangles, material, {"skin": 0, **(own or {})})
    column = lambda y: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, y, 0, 1]
    joint = model.add("nodes", {"translation": [0, 0.2, 0], "rotation": turned(-50)})
    root = model.add("nodes", {"translation": [0.2, -0.2, 0], "children": [joint]})
    model.root["scenes"][0]["nodes"].append(root)
    binds = model.accessor([column(0.0), column(-0.2)])
    model.add("skins", {"joints": [root, joint], "inverseBindMatrices": binds})
    animate(model, joint, "rotation", [0, 1], [turned(-50), turned(70)])
    model.write(path)


def grown(n):
    """Returns the point of a ball that has a bulge, and is bent."""
    bulge = 0.5 * math.exp(-8 * ((n[0] - 0.7) ** 2 + (n[1] - 0.5) ** 2 + (n[2] - 0.5) ** 2))
    return [n[0] * (1 + bulge) + 0.3 * n[1] * n[1], n[1] * (1 + bulge), n[2] * (1 + bulge)]


def normal_of(surface, n):
    """Returns the normal of a deformed ball by differences."""
    cross = lambda a, b: [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    unit = lambda v: [x / math.sqrt(sum(y * y for y in v)) for x in v]
    step = lambda a, by: unit([x + 1e-4 * y for x, y in zip(a, by)])
    across = unit(cross(n, [0, 1, 0] if abs(n[1]) < 0.9 else [1, 0, 0]))
    along = cross(n, across)
    edges = [[(x - y) for x, y in zip(surface(step(n, v)), surface(step(n, [-x for x in v])))] for v in (across, along)]
    return unit(cross(*edges))


def morphed(path, weight, animated=None):
    """Writes a ball with a morph target, which is exact at weight 1."""
    model = Model()
    positions, normals, _, triangles = ball()
    less = lambda a, b: [x - y for x, y in zip(a, b)]
    attributes = {"POSITION": model.accessor(positions), "NORMAL": model.accessor(normals)}
    model.mesh(attributes, triangles, model.add("materials", {"pbrMetallicRoughness": pbr(0.6)}))
    mesh = model.root["meshes"][-1]
    mesh["weights"] = [weight]
    mesh["primitives"][0]["targets"] = [
        {
            "POSITION": model.accessor([less(grown(n), n) for n in normals]),
            "NORMAL": model.accessor([less(normal_of(grown, n), n) for n in normals]),
        }
    ]
    if animated:
        animate(model, 1, "weights", [0, 1], animated)
    model.write(path)


def instanced(path):
    model = Model()
    positions, normals, _, triangles = ball(12)
    attributes = {"POSITION": model.accessor(positions), "NORMAL": model.accessor(normals)}
    places = [[x - 1.0, y - 1.0, 0] for x in range(3) for y in range(3)]
    instances = {
        "TRANSLATION": model.accessor(places),
        "ROTATION": model.accessor([turned(20 * i) for i in range(9)]),
        "SCALE": model.accessor([[0.2 + 0.02 * i, 0.35, 0.3] for i in range(9)]),
    }
    model.root["extensionsUsed"].append("EXT_mesh_gpu_instancing")
    node = {"extensions": {"EXT_mesh_gpu_instancing": {"attributes": instances}}}
    model.mesh(attributes, triangles, model.add("materials", {"pbrMetallicRoughness": pbr(0.6)}), node)
    model.write(path)


def layered(path, extensions=None, base=None, shape=None, tangents=False):
    """Writes a ball with extensions of its material, by their names without KHR_materials_."""
    model = Model()
    positions, normals, uvs, triangles = shape or ball(32)
    extensions = {f"KHR_materials_{name}": value for name, value in (extensions or {}).items()}
    model.root["extensionsUsed"] += extensions
    material = {"pbrMetallicRoughness": pbr(0.5) if base is None else base, "extensions": extensions}
    attributes = {
        "POSITION": model.accessor(positions),
        "NORMAL": model.accessor(normals),
        "TEXCOORD_0": model.accessor(uvs),
    }
    if tangents:
        around = lambda n: math.atan2(-n[2], n[0])
        along = [[-math.sin(around(n)), 0, -math.cos(around(n)), 1] for n in normals]
        attributes["TANGENT"] = model.accessor(along)
    model.mesh(attributes, triangles, model.add("materials", material))
    model.write(path)


def materials():
    """Writes models of one material extension each."""
    white = pbr(0.0, colour=(1, 1, 1))
    layered("default.glb", base={})
    for roughness in (0.3, 0.6):
        layered(f"metal_{roughness}.glb", base=pbr(roughness, 1))
    layered("coat.glb", {"clearcoat": {"clearcoatFactor": 1, "clearcoatRoughnessFactor": 0.2}})
    layered("coat_metal.glb", {"clearcoat": {"clearcoatFactor": 0.7, "clearcoatRoughnessFactor": 0.1}}, pbr(0.5, 1))
    layered("sheen.glb", {"sheen": {"sheenColorFactor": [0.9, 0.4, 0.3], "sheenRoughnessFactor": 0.5}}, pbr(0.8))
    layered("specular_none.glb", {"specular": {"specularFactor": 0}}, pbr(0.3))
    layered("specular_colour.glb", {"specular": {"specularColorFactor": [1, 0.3, 0.1]}}, pbr(0.3))
    layered("ior_2.glb", {"ior": {"ior": 2}}, pbr(0.3))
    stretched = {"anisotropy": {"anisotropyStrength": 0.7, "anisotropyRotation": 0.5}}
    layered("anisotropy.glb", stretched, pbr(0.3, 1), tangents=True)
    film = {"iridescenceFactor": 1, "iridescenceIor": 1.3, "iridescenceThicknessMaximum": 420}
    layered("film.glb", {"iridescence": film}, pbr(0.3))
    layered("film_metal.glb", {"iridescence": film}, pbr(0.3, 1))
    clear = {"transmission": {"transmissionFactor": 1}, "volume": {"thicknessFactor": 1}}
    layered("glass.glb", clear, white)
    inside = {"thicknessFactor": 1, "attenuationDistance": 0.8, "attenuationColor": [0.3, 0.8, 0.5]}
    layered("volume.glb", {**clear, "volume": inside}, white)
    layered("volume_rough.glb", {**clear, "volume": inside}, pbr(0.4, colour=(1, 1, 1)))
    layered("unlit.glb", {"unlit": {}})
    passed = {"diffuseTransmissionFactor": 0.6, "diffuseTransmissionColorFactor": [0.9, 0.6, 0.3]}
    layered("leaf.glb", {"diffuse_transmission": passed}, pbr(1.0), square())


def motion():
    """Writes models whose name states their time, if it is not that of the file's own pose."""
    keys = [[0, 0, 0], [1, 0.5, 0], [-0.5, 0.5, 0.5]]
    moved("node_linear_at_1.5s.glb", "translation", keys)
    moved("node_step_at_1.5s.glb", "translation", keys, "STEP")
    spline = [[0, 0, 0], [0, 0, 0], [1, 1, 0], [1, 0, 0], [1, 0.5, 0], [0, 2, 0], [0, 0, 0], keys[2], [0, 0, 0]]
    moved("node_spline_at_0.75s.glb", "translation", spline, "CUBICSPLINE")
    moved("node_turned_at_0.25s.glb", "rotation", [turned(0), turned(140), turned(200)])
    moved("node_scaled_at_1.5s.glb", "scale", [[1, 1, 1], [0.5, 1.5, 1], [1.5, -0.5, 1]])
    skinned("skin_at_0s.glb")
    skinned("skin_at_0.5s.glb", {"translation": [5, 0, 0]})
    morphed("morph.glb", 1)
    morphed("morph_at_0.5s.glb", 0, [0, 2])
    instanced("instances.glb")


def main():
    motion()
    materials()
    for roughness in (0.6, 1.0):
        mapped(f"square_plain_{roughness}.glb", square(), roughness, scale=None)
        mapped(f"square_{roughness}.glb", square(), roughness)
    mapped("square_scale_2.5.glb", square(), 0.6, scale=2.5)
    mapped("square_mirrored.glb", square(), 0.6, node={"scale": [-1, 1, 1]})
    mapped("square_turned.glb", square(), 0.6, turned=True)
    mapped("square_metal.glb", square(), 0.35, metallic=1)
    mapped("ball_plain.glb", ball(), 0.5, scale=None)
    mapped("ball.glb", ball(), 0.5, waves=6)
    mapped("ball_stretched.glb", ball(), 0.5, waves=6, node={"scale": [1, -1.2, 0.8]})
    around = lambda n: math.atan2(-n[2], n[0])
    tangents = [[-math.sin(around(n)), 0, -math.cos(around(n)), 1] for n in ball()[1]]
    mapped("ball_own_tangents.glb", ball(), 0.5, tangents=tangents)
    coloured("colours_float.glb", lambda c: c, FLOAT)
    coloured("colours_byte.glb", lambda c: [round(255 * x) for x in c] + [255], BYTE)
    coloured("colours_short.glb", lambda c: [round(65535 * x) for x in c] + [65535], SHORT)
    two_sets("two_sets.glb")


if __name__ == "__main__":
    main()
