#!/usr/bin/env python3
"""Writes small glTF models, one feature or pair of features each, to the current folder.

Each has a square or a ball around the origin, and a quad that emits from both sides.
Large buffers are files that the models share; `panorama.pfm` is an environment for all."""

import base64
import json
import math
import struct
import zlib

FLOAT, UINT, BYTE, SHORT = (5126, "f"), (5125, "I"), (5121, "B"), (5123, "H")
SIGNED_BYTE, SIGNED_SHORT = (5120, "b"), (5122, "h")


def png(size, pixels, channels=3):
    """Returns a square PNG file of 8-bit RGB or RGBA pixels, row by row from the top."""
    width = size * channels
    rows = b"".join(b"\0" + bytes(pixels[y * width : (y + 1) * width]) for y in range(size))
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    header = struct.pack(">IIBBBBB", size, size, 8, 2 if channels == 3 else 6, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


class Model:
    """A .gltf file under construction, with the light in it."""

    def __init__(self):
        self.accessors = {}
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

    def use(self, extension):
        if extension not in self.root["extensionsUsed"]:
            self.root["extensionsUsed"].append(extension)

    def view(self, data, stride=None):
        if len(data) > 600:
            uri = f"{zlib.crc32(data):08x}.bin"
            with open(uri, "wb") as file:
                file.write(data)
        else:
            uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
        buffer = self.add("buffers", {"uri": uri, "byteLength": len(data)})
        view = {"buffer": buffer, "byteLength": len(data)}
        return self.add("bufferViews", {**view, "byteStride": stride} if stride else view)

    def accessor(self, rows, component=FLOAT, normalized=True):
        """Adds an accessor; rows of bytes and shorts are padded to 4 bytes."""
        code, letter = component
        rows = [row if isinstance(row, list) else [row] for row in rows]
        width = len(rows[0])
        size = width * struct.calcsize(letter)
        pad = -size % 4 if width > 1 else 0
        data = b"".join(struct.pack(f"<{width}{letter}{pad}x", *row) for row in rows)
        kind = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}[width]
        key = (data, code, kind, normalized)
        if key not in self.accessors:
            accessor = {"componentType": code, "count": len(rows), "type": kind}
            accessor["bufferView"] = self.view(data, size + pad if pad else None)
            if letter in "bBhH" and width > 1 and normalized:
                accessor["normalized"] = True
            if width in (1, 3):
                for name, of in (("min", min), ("max", max)):
                    accessor[name] = [of(row[i] for row in rows) for i in range(width)]
            self.accessors[key] = self.add("accessors", accessor)
        return self.accessors[key]

    def texture(self, file, **sampler):
        image = self.add("images", {"bufferView": self.view(file), "mimeType": "image/png"})
        number = self.add("samplers", {**self.root["samplers"][0], **sampler}) if sampler else 0
        return self.add("textures", {"source": image, "sampler": number})

    def mesh(self, attributes, indices, material, node=None, **primitive):
        part = {"attributes": attributes, **primitive}
        if indices:
            part["indices"] = self.accessor(indices, SHORT)
        if material is not None:
            part["material"] = material
        mesh = self.add("meshes", {"primitives": [part]})
        return self.node({"mesh": mesh, **(node or {})})

    def node(self, node):
        """Adds a root."""
        self.root["scenes"][0]["nodes"].append(self.add("nodes", node))
        return len(self.root["nodes"]) - 1

    def shape(self, shape, uvs=False):
        """Returns the attributes of a shape, and its triangles."""
        positions, normals, coordinates, triangles = shape
        attributes = {"POSITION": self.accessor(positions), "NORMAL": self.accessor(normals)}
        if uvs:
            attributes["TEXCOORD_0"] = self.accessor(coordinates)
        return attributes, triangles

    def write(self, path):
        with open(path, "w") as file:
            json.dump(self.root, file, separators=(",", ":"))
            file.write("\n")


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


def ball(rows=20):
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


def coat_map(path):
    model = Model()
    model.use("KHR_materials_clearcoat")
    positions, normals, uvs, triangles = square()
    coat = {
        "clearcoatFactor": 1,
        "clearcoatRoughnessFactor": 0.4,
        "clearcoatNormalTexture": {"index": model.texture(bumps(2, slope=0.4))},
    }
    material = {"pbrMetallicRoughness": pbr(0.5), "extensions": {"KHR_materials_clearcoat": coat}}
    attributes = {
        "POSITION": model.accessor(positions),
        "NORMAL": model.accessor(normals),
        "TEXCOORD_0": model.accessor(uvs),
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


def moved(path, key, values, interpolation="LINEAR", first=0):
    """Writes a square that an animation moves."""
    model = Model()
    positions, normals, _, triangles = square()
    positions = [[0.6 * x, 0.4 * y, z] for x, y, z in positions]
    attributes = {"POSITION": model.accessor(positions), "NORMAL": model.accessor(normals)}
    model.mesh(attributes, triangles, model.add("materials", {"pbrMetallicRoughness": pbr(0.6)}))
    animate(model, 1, key, [first, 1, 2], values, interpolation)
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


def morphed(path, weight, animated=None, interpolation="LINEAR"):
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
        animate(model, 1, "weights", [0, 1], animated, interpolation)
    model.write(path)


def instanced(path):
    model = Model()
    positions, normals, _, triangles = ball(10)
    attributes = {"POSITION": model.accessor(positions), "NORMAL": model.accessor(normals)}
    places = [[x - 1.0, y - 1.0, 0] for x in range(3) for y in range(3)]
    instances = {
        "TRANSLATION": model.accessor(places),
        "ROTATION": model.accessor([turned(20 * i) for i in range(9)]),
        "SCALE": model.accessor([[0.2 + 0.02 * i, 0.35, 0.3] for i in range(9)]),
    }
    model.use("EXT_mesh_gpu_instancing")
    node = {"extensions": {"EXT_mesh_gpu_instancing": {"attributes": instances}}}
    model.mesh(attributes, triangles, model.add("materials", {"pbrMetallicRoughness": pbr(0.6)}), node)
    model.write(path)


def layered(path, extensions=None, base=None, shape=None, tangents=False):
    """Writes a ball with extensions of its material, by their names without KHR_materials_."""
    model = Model()
    positions, normals, uvs, triangles = shape or ball()
    extensions = {f"KHR_materials_{name}": value for name, value in (extensions or {}).items()}
    for name in extensions:
        model.use(name)
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
    layered("default.gltf", base={})
    for roughness in (0.3, 0.6):
        layered(f"metal_{roughness}.gltf", base=pbr(roughness, 1))
    layered("coat.gltf", {"clearcoat": {"clearcoatFactor": 1, "clearcoatRoughnessFactor": 0.2}})
    coat_map("coat_map.gltf")
    layered("coat_metal.gltf", {"clearcoat": {"clearcoatFactor": 0.7, "clearcoatRoughnessFactor": 0.1}}, pbr(0.5, 1))
    layered("sheen.gltf", {"sheen": {"sheenColorFactor": [0.9, 0.4, 0.3], "sheenRoughnessFactor": 0.5}}, pbr(0.8))
    layered("specular_none.gltf", {"specular": {"specularFactor": 0}}, pbr(0.3))
    layered("specular_colour.gltf", {"specular": {"specularColorFactor": [1, 0.3, 0.1]}}, pbr(0.3))
    layered("ior_2.gltf", {"ior": {"ior": 2}}, pbr(0.3))
    stretched = {"anisotropy": {"anisotropyStrength": 0.7, "anisotropyRotation": 0.5}}
    layered("anisotropy.gltf", stretched, pbr(0.3, 1), tangents=True)
    film = {"iridescenceFactor": 1, "iridescenceIor": 1.3, "iridescenceThicknessMaximum": 420}
    layered("film.gltf", {"iridescence": film}, pbr(0.3))
    layered("film_metal.gltf", {"iridescence": film}, pbr(0.3, 1))
    clear = {"transmission": {"transmissionFactor": 1}, "volume": {"thicknessFactor": 1}}
    layered("glass.gltf", clear, white)
    inside = {"thicknessFactor": 1, "attenuationDistance": 0.8, "attenuationColor": [0.3, 0.8, 0.5]}
    layered("volume.gltf", {**clear, "volume": inside}, white)
    layered("volume_rough.gltf", {**clear, "volume": inside}, pbr(0.4, colour=(1, 1, 1)))
    layered("thin_wall.gltf", {"transmission": {"transmissionFactor": 0.8}}, pbr(0.3, colour=(0.9, 0.7, 0.6)))
    layered("dispersion.gltf", {**clear, "ior": {"ior": 1.6}, "dispersion": {"dispersion": 2}}, white)
    layered("unlit.gltf", {"unlit": {}})
    passed = {"diffuseTransmissionFactor": 0.6, "diffuseTransmissionColorFactor": [0.9, 0.6, 0.3]}
    layered("leaf.gltf", {"diffuse_transmission": passed}, pbr(1.0), square())


def motion():
    """Writes models whose name states their time, if it is not that of the file's own pose."""
    keys = [[0, 0, 0], [1, 0.5, 0], [-0.5, 0.5, 0.5]]
    moved("node_linear_at_1.5s.gltf", "translation", keys)
    moved("node_step_at_1.5s.gltf", "translation", keys, "STEP")
    spline = [[0, 0, 0], [0, 0, 0], [1, 1, 0], [1, 0, 0], [1, 0.5, 0], [0, 2, 0], [0, 0, 0], keys[2], [0, 0, 0]]
    moved("node_spline_at_0.75s.gltf", "translation", spline, "CUBICSPLINE")
    moved("node_turned_at_0.25s.gltf", "rotation", [turned(0), turned(140), turned(200)])
    moved("node_scaled_at_1.5s.gltf", "scale", [[1, 1, 1], [0.5, 1.5, 1], [1.5, -0.5, 1]])
    skinned("skin_at_0s.gltf")
    skinned("skin_at_0.5s.gltf", {"translation": [5, 0, 0]})
    morphed("morph.gltf", 1)
    morphed("morph_at_0.5s.gltf", 0, [0, 2])
    arcs = [[0, 0, 0, 0], turned(0), [0, 0, 1, 0], [0, 0, 1, 0], turned(90), [0, 0, 0, 0], [0, 0, 0, 0], turned(200)]
    moved("node_turned_spline_at_0.5s.gltf", "rotation", arcs + [[0, 0, 0, 0]], "CUBICSPLINE")
    moved("node_turned_step_at_1.5s.gltf", "rotation", [turned(0), turned(40), turned(200)], "STEP")
    moved("node_before_at_0.2s.gltf", "translation", keys, first=0.5)
    morphed("morph_step_at_0.5s.gltf", 0, [1, 0], "STEP")
    instanced("instances.gltf")


def plain(model, shape, node=None, material=None, **primitive):
    """Adds a mesh of a plain material and returns its node."""
    attributes, triangles = model.shape(shape)
    material = material or {"pbrMetallicRoughness": pbr(0.6)}
    return model.mesh(attributes, triangles, model.add("materials", material), node, **primitive)


def geometry():
    """Writes models of ways to store and place triangles."""
    model = Model()
    corners = [[-1.2, -1, 0], [-0.1, -1, 0], [-1.2, 1, 0.3], [-0.1, 1, 0.3]]
    gray = model.add("materials", {"pbrMetallicRoughness": pbr(0.6)})
    model.mesh({"POSITION": model.accessor(corners)}, [0, 1, 2, 3], gray, mode=5)
    fan = [[0.7, 0, 0.3]] + [[0.7 + 0.5 * math.cos(a), math.sin(a), 0] for a in (i * math.pi / 3 for i in range(7))]
    model.mesh({"POSITION": model.accessor(fan)}, None, gray, mode=6)
    model.write("strip_fan.gltf")

    model = Model()  # no indices, no normals, no material
    positions, _, _, triangles = ball(6)
    model.mesh({"POSITION": model.accessor([positions[i] for i in triangles])}, None, None)
    model.write("flat_without_material.gltf")

    model = Model()
    attributes, triangles = model.shape(square())
    sparse = model.root["accessors"][attributes["POSITION"]]
    sparse["sparse"] = {
        "count": 2,
        "indices": {"bufferView": model.view(struct.pack("<2H", 1, 2)), "componentType": 5123},
        "values": {"bufferView": model.view(struct.pack("<6f", 0.9, -0.6, 0.4, 0.6, 0.9, 0.4))},
    }
    sparse["max"] = [0.9, 0.9, 0.4]
    del attributes["NORMAL"]
    model.mesh(attributes, triangles, model.add("materials", {"pbrMetallicRoughness": pbr(0.6)}))
    model.write("sparse.gltf")

    model = Model()
    model.use("KHR_mesh_quantization")
    model.root["extensionsRequired"] = ["KHR_mesh_quantization"]
    positions, normals, _, triangles = ball()
    attributes = {
        "POSITION": model.accessor([[round(32767 * x) for x in p] for p in positions], SIGNED_SHORT),
        "NORMAL": model.accessor([[round(127 * x) for x in n] for n in normals], SIGNED_BYTE),
    }
    gray = model.add("materials", {"pbrMetallicRoughness": pbr(0.6)})
    model.mesh(attributes, triangles, gray, {"scale": [1.1, 0.8, 1]})
    model.write("quantized.gltf")

    model = Model()  # two primitives, a rotation below a scale that mirrors: a shear
    first = plain(model, square())
    model.root["scenes"][0]["nodes"].remove(first)
    cosine, sine = math.cos(0.5), math.sin(0.5)
    columns = [[0.6 * cosine, 0.6 * sine, 0, 0], [-0.5 * sine, 0.5 * cosine, 0, 0], [0, 0, 0.5, 0], [0.4, -0.3, 0, 1]]
    model.root["nodes"][first]["matrix"] = [x for column in columns for x in column]
    attributes, triangles = model.shape(ball(10))
    red = model.add("materials", {"pbrMetallicRoughness": pbr(0.4, colour=(0.8, 0.2, 0.1))})
    part = {"attributes": attributes, "indices": model.accessor(triangles, SHORT), "material": red}
    model.root["meshes"][-1]["primitives"].append(part)
    model.node({"children": [first], "scale": [-1.2, 0.7, 1], "rotation": turned(30)})
    model.write("sheared.gltf")

    model = Model()  # its back towards the camera
    back = {"rotation": [0, 1, 0, 0], "scale": [0.4, 0.9, 1]}
    both = {"doubleSided": True, "pbrMetallicRoughness": pbr(0.6)}
    plain(model, square(), {**back, "translation": [-0.6, 0, 0]})
    plain(model, square(), {**back, "translation": [0.6, 0, 0]}, both)
    model.write("double_sided.gltf")

    model = Model()
    shadow = plain(model, ball(10), {"scale": [0.4] * 3, "translation": [0.5, 0.5, 0.5]})
    model.use("KHR_node_visibility")
    model.root["nodes"][shadow]["extensions"] = {"KHR_node_visibility": {"visible": False}}
    plain(model, square())
    model.write("invisible.gltf")

    model = Model()  # two sets of joints: weights of five joints, of which the fifth has most
    positions, normals, _, triangles = square()
    attributes, _ = model.shape(square())
    count = len(positions)
    attributes["JOINTS_0"] = model.accessor([[0, 0, 0, 0]] * count, BYTE, False)
    attributes["WEIGHTS_0"] = model.accessor([[26, 25, 0, 0]] * count, BYTE)
    attributes["JOINTS_1"] = model.accessor([[1, 0, 0, 0]] * count, BYTE, False)
    attributes["WEIGHTS_1"] = model.accessor([[204, 0, 0, 0]] * count, BYTE)
    skinned = model.mesh(attributes, triangles, model.add("materials", {"pbrMetallicRoughness": pbr(0.6)}), {"skin": 0})
    joints = [model.node({}), model.node({"translation": [0.7, 0.3, 0], "rotation": turned(20)})]
    model.add("skins", {"joints": joints})
    model.write("skin_two_sets.gltf")


def colours_and_textures():
    """Writes models of textures, their wrapping and transforms, and of alpha."""

    def textured(path, material, uvs=None, extra=None, shape=None):
        """`material` is a function of a model that returns the material."""
        model = Model()
        positions, normals, coordinates, triangles = shape or square()
        attributes = {
            "POSITION": model.accessor(positions),
            "NORMAL": model.accessor(normals),
            "TEXCOORD_0": model.accessor(uvs or coordinates),
            **(extra(model) if extra else {}),
        }
        model.mesh(attributes, triangles, model.add("materials", material(model)))
        model.write(path)

    def base(image, roughness=0.7, transform=None, alpha=None, **sampler):
        def material(model):
            texture = {"index": model.texture(image, **sampler)}
            if transform:
                model.use("KHR_texture_transform")
                texture["extensions"] = {"KHR_texture_transform": transform}
            white = {**pbr(roughness, colour=(1, 1, 1)), "baseColorTexture": texture}
            return {"pbrMetallicRoughness": white, **(alpha or {})}

        return material

    far = [[2.5 * u - 0.8, 2.5 * v - 0.6] for u, v in square()[2]]
    textured("texture_smooth.gltf", base(waves()))
    textured("texture_ball.gltf", base(waves()), shape=ball())
    textured("wrap_mirror_clamp.gltf", base(waves(), wrapS=33648, wrapT=33071), far)
    textured("wrap_repeat.gltf", base(waves()), far)
    textured("nearest.gltf", base(checker(16), magFilter=9728, minFilter=9728))
    shifted = {"offset": [0.2, 0.3], "rotation": 0.5, "scale": [1.5, 0.7]}
    textured("texture_transform.gltf", base(waves(), transform=shifted))
    disc = lambda u, v: 255 if math.hypot(u - 0.5, v - 0.5) < 0.36 else 0
    ramp = lambda u, v: round(255 * u)
    textured("alpha_mask.gltf", base(waves(disc), alpha={"alphaMode": "MASK", "alphaCutoff": 0.4}))
    textured("alpha_blend.gltf", base(waves(ramp), alpha={"alphaMode": "BLEND"}))
    textured("alpha_opaque.gltf", base(waves(ramp)))
    clear = {"alphaMode": "BLEND", "pbrMetallicRoughness": {**pbr(0.6), "baseColorFactor": [0.8, 0.3, 0.3, 0.4]}}
    textured("alpha_factor.gltf", lambda model: clear)
    faded = lambda model: {"COLOR_0": model.accessor([[1, 1, 1, 0], [1, 0.5, 1, 1], [1, 1, 0.5, 1], [0.5, 1, 1, 0]])}
    textured("alpha_colours.gltf", lambda model: {**clear, "pbrMetallicRoughness": pbr(0.6)}, extra=faded)

    def rough(model):
        image = model.texture(waves(colours=((0, 150, 255), (0, 80, 0))))
        return {"pbrMetallicRoughness": {**pbr(1, 1), "metallicRoughnessTexture": {"index": image}}}

    textured("metal_roughness_texture.gltf", rough)
    textured("metal_roughness_ball.gltf", rough, shape=ball())

    def emissive(model):
        return {
            "emissiveFactor": [0.6, 0.8, 1],
            "emissiveTexture": {"index": model.texture(waves())},
            "pbrMetallicRoughness": pbr(0.6, colour=(0.2, 0.2, 0.2)),
        }

    textured("emissive_texture.gltf", emissive)
    occluded = lambda model: {"occlusionTexture": {"index": model.texture(waves())}, "pbrMetallicRoughness": pbr(0.6)}
    textured("occlusion.gltf", occluded)

    def glossy(model):
        model.use("KHR_materials_pbrSpecularGlossiness")
        gloss = {"diffuseFactor": [0.6, 0.3, 0.2, 1], "specularFactor": [0.2, 0.25, 0.3], "glossinessFactor": 0.4}
        return {"extensions": {"KHR_materials_pbrSpecularGlossiness": gloss}}

    textured("specular_glossiness.gltf", glossy, shape=ball())

    def variants(model):
        model.use("KHR_materials_variants")
        model.root["extensions"] = {"KHR_materials_variants": {"variants": [{"name": "red"}]}}
        return {"pbrMetallicRoughness": pbr(0.6, colour=(0.3, 0.6, 0.3))}

    textured("variants_default.gltf", variants)


def waves(alpha=None, size=32, colours=((230, 60, 40), (240, 240, 230))):
    """Returns a smooth image of two colours, whose alpha is a function of place."""
    pixels = []
    for i in range(size * size):
        u, v = (i % size + 0.5) / size, (i // size + 0.5) / size
        share = 0.5 + 0.25 * (math.sin(2 * math.pi * u) + math.cos(2 * math.pi * (v + 0.5 * u)))
        pixels += [round(a + (b - a) * share) for a, b in zip(*colours)] + ([alpha(u, v)] if alpha else [])
    return png(size, pixels, 4 if alpha else 3)


def lights_and_cameras():
    """Writes models with lights without extent, and with cameras of their own."""

    def lit(path, light, node):
        model = Model()
        model.use("KHR_lights_punctual")
        model.root["extensions"] = {"KHR_lights_punctual": {"lights": [light]}}
        plain(model, square())
        plain(model, ball(10), {"scale": [0.3] * 3, "translation": [0, 0, 0.4]})
        model.node({**node, "extensions": {"KHR_lights_punctual": {"light": 0}}})
        model.write(path)

    tilted = {"rotation": [math.sin(-0.3), 0, 0, math.cos(0.3)]}
    lit("light_directional.gltf", {"type": "directional", "color": [1, 0.8, 0.5], "intensity": 2}, tilted)
    lit("light_point.gltf", {"type": "point", "color": [0.5, 0.8, 1], "intensity": 3}, {"translation": [0.8, 0.6, 1]})
    cone = {"innerConeAngle": 0.3, "outerConeAngle": 0.5}
    lit("light_spot.gltf", {"type": "spot", "intensity": 8, "spot": cone}, {**tilted, "translation": [0, 1.2, 2]})
    hard = {"innerConeAngle": 0.399, "outerConeAngle": 0.4}
    lit("light_spot_hard.gltf", {"type": "spot", "intensity": 8, "spot": hard}, {**tilted, "translation": [0, 1.2, 2]})

    def seen(path, camera, node):
        model = Model()
        plain(model, square())
        plain(model, ball(10), {"scale": [0.3] * 3, "translation": [0.2, 0.3, 0.4]})
        model.node({**node, "camera": model.add("cameras", camera)})
        model.write(path)

    aside = {"translation": [1.5, 1, 3], "rotation": [-0.14 * 0.97, 0.23, 0.03, 0.96]}
    length = math.sqrt(sum(x * x for x in aside["rotation"]))
    aside["rotation"] = [x / length for x in aside["rotation"]]
    lens = {"yfov": 0.6, "znear": 0.1, "aspectRatio": 1}
    seen("camera_perspective.gltf", {"type": "perspective", "perspective": lens}, aside)
    for path, size, node in (("", 1.7, aside), ("_front", 1.4, {"translation": [0, 0, 4]})):
        parallel = {"xmag": size, "ymag": size, "znear": 0.01, "zfar": 100}
        seen(f"camera_orthographic{path}.gltf", {"type": "orthographic", "orthographic": parallel}, node)


def panorama(path, width=64, height=32):
    """Writes an environment of soft lights; the top row is straight up, the middle is seen along -z."""
    lobes = [((0.5, 0.6, 0.6), 8, (3, 2.6, 2)), ((-0.8, 0.1, 0.5), 4, (0.2, 0.4, 0.9))]
    lobes.append(((0, 0.2, -1), 6, (0.3, 0.7, 0.3)))
    rows = []
    for j in reversed(range(height)):  # a PFM file begins with the lowest row
        for i in range(width):
            polar, around = math.pi * (j + 0.5) / height, 2 * math.pi * ((i + 0.5) / width - 0.5)
            d = (math.sin(polar) * math.sin(around), math.cos(polar), -math.sin(polar) * math.cos(around))
            pixel = [0.08] * 3
            for axis, power, colour in lobes:
                cosine = sum(a * b for a, b in zip(axis, d)) / math.sqrt(sum(a * a for a in axis))
                pixel = [p + c * max(cosine, 0) ** power for p, c in zip(pixel, colour)]
            rows.append(struct.pack("<3f", *pixel))
    with open(path, "wb") as file:
        file.write(f"PF\n{width} {height}\n-1.0\n".encode() + b"".join(rows))


def main():
    panorama("panorama.pfm")
    geometry()
    colours_and_textures()
    lights_and_cameras()
    motion()
    materials()
    for roughness in (0.6, 1.0):
        mapped(f"square_plain_{roughness}.gltf", square(), roughness, scale=None)
        mapped(f"square_{roughness}.gltf", square(), roughness)
    mapped("square_scale_2.5.gltf", square(), 0.6, scale=2.5)
    mapped("square_mirrored.gltf", square(), 0.6, node={"scale": [-1, 1, 1]})
    mapped("square_turned.gltf", square(), 0.6, turned=True)
    mapped("square_metal.gltf", square(), 0.35, metallic=1)
    mapped("ball_plain.gltf", ball(), 0.5, scale=None)
    mapped("ball.gltf", ball(), 0.5, waves=6)
    mapped("ball_stretched.gltf", ball(), 0.5, waves=6, node={"scale": [1, -1.2, 0.8]})
    around = lambda n: math.atan2(-n[2], n[0])
    tangents = [[-math.sin(around(n)), 0, -math.cos(around(n)), 1] for n in ball()[1]]
    mapped("ball_own_tangents.gltf", ball(), 0.5, tangents=tangents)
    coloured("colours_float.gltf", lambda c: c, FLOAT)
    coloured("colours_byte.gltf", lambda c: [round(255 * x) for x in c] + [255], BYTE)
    coloured("colours_short.gltf", lambda c: [round(65535 * x) for x in c] + [65535], SHORT)
    two_sets("two_sets.gltf")


if __name__ == "__main__":
    main()
