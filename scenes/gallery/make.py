#!/usr/bin/env python3
"""Writes the models and textures of the gallery's scenes into the folder of this file.

    python3 scenes/gallery/make.py

It needs Python 3.8 or newer, without packages. The bytes are the same each time with one version
of Python and zlib. Made for this project; CC0-1.0.
"""

import json
import math
import random
import struct
import zlib
from math import cos, pi, sin, sqrt, tau
from pathlib import Path

HERE = Path(__file__).resolve().parent

# Vectors ------------------------------------------------------------------------------------------


def add(a, b):
    """Returns a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def sub(a, b):
    """Returns a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def mul(a, s):
    """Returns a times the number s."""
    return (a[0] * s, a[1] * s, a[2] * s)


def dot(a, b):
    """Returns the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    """Returns the vector product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    """Returns a with length 1, or +y for a vector of length 0."""
    length = sqrt(dot(a, a))
    return mul(a, 1 / length) if length > 1e-12 else (0.0, 1.0, 0.0)


def rotated(q, a):
    """Returns a rotated by the unit quaternion q, whose real part is last."""
    twice = mul(cross(q[:3], a), 2)
    return add(add(a, mul(twice, q[3])), cross(q[:3], twice))


def lerp(a, b, t):
    """Returns the number a + (b - a) t."""
    return a + (b - a) * t


# Meshes -------------------------------------------------------------------------------------------


class Mesh:
    """Triangles with a position, a normal and texture coordinates at each vertex."""

    def __init__(self):
        self.positions, self.normals, self.uvs, self.triangles = [], [], [], []

    def vertex(self, position, normal, uv=(0.0, 0.0)):
        """Appends a vertex and returns its index."""
        self.positions.append(position)
        self.normals.append(unit(normal))
        self.uvs.append(uv)
        return len(self.positions) - 1

    def triangle(self, a, b, c):
        """Appends a triangle, turned so that its front is where its normals point."""
        p, q, r = (self.positions[i] for i in (a, b, c))
        face = cross(sub(q, p), sub(r, p))
        if dot(face, face) < 1e-24:
            return
        mean = add(add(self.normals[a], self.normals[b]), self.normals[c])
        self.triangles.append((a, b, c) if dot(face, mean) > 0 else (a, c, b))

    def quad(self, a, b, c, d):
        """Appends the quad with the corners a, b, c and d in order around it."""
        self.triangle(a, b, c)
        self.triangle(a, c, d)

    def grid(self, rows):
        """Appends the quads between neighbours of rows of vertex indices."""
        for low, high in zip(rows, rows[1:]):
            for k in range(len(low) - 1):
                self.quad(low[k], low[k + 1], high[k + 1], high[k])

    def __add__(self, other):
        """Returns both meshes as one."""
        joined, first = Mesh(), len(self.positions)
        joined.positions = self.positions + other.positions
        joined.normals = self.normals + other.normals
        joined.uvs = self.uvs + other.uvs
        joined.triangles = self.triangles + [tuple(first + i for i in t) for t in other.triangles]
        return joined

    def map(self, position, normal=lambda n: n):
        """Returns the mesh with a function of each position and one of each normal."""
        mapped = Mesh()
        mapped.positions = [position(p) for p in self.positions]
        mapped.normals = [unit(normal(n)) for n in self.normals]
        mapped.uvs, mapped.triangles = list(self.uvs), list(self.triangles)
        return mapped

    def move(self, x, y, z):
        """Returns the mesh moved."""
        return self.map(lambda p: add(p, (x, y, z)))

    def scale(self, x, y, z):
        """Returns the mesh scaled along each axis, by factors above 0."""
        return self.map(lambda p: (p[0] * x, p[1] * y, p[2] * z), lambda n: (n[0] / x, n[1] / y, n[2] / z))

    def turn(self, axis, degrees):
        """Returns the mesh turned about an axis, counter-clockwise seen against it."""
        c, s = cos(math.radians(degrees)), sin(math.radians(degrees))
        i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]

        def rotate(p):
            q = list(p)
            q[i], q[j] = c * p[i] - s * p[j], s * p[i] + c * p[j]
            return tuple(q)

        return self.map(rotate, rotate)

    def flip(self):
        """Returns the mesh with its front on the other side."""
        flipped = self.map(lambda p: p, lambda n: mul(n, -1))
        flipped.triangles = [(a, c, b) for a, b, c in self.triangles]
        return flipped


def smooth(points, steps=6):
    """Returns a Catmull-Rom curve through points, with `steps` pieces between two of them."""
    curve = []
    for k in range(len(points) - 1):
        p0, p1 = points[max(k - 1, 0)], points[k]
        p2, p3 = points[k + 1], points[min(k + 2, len(points) - 1)]
        for j in range(steps):
            t = j / steps
            curve.append(
                tuple(0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t * t +
                             (3 * b - a - 3 * c + d) * t**3) for a, b, c, d in zip(p0, p1, p2, p3)))
    return curve + [points[-1]]


def bevel(points, radius, steps=3):
    """Returns an open polygon with each inner corner rounded."""
    rounded = [points[0]]
    for before, corner, after in zip(points, points[1:], points[2:]):
        ends = []
        for other in (before, after):
            way = [o - c for o, c in zip(other, corner)]
            length = sqrt(sum(w * w for w in way))
            share = min(radius, 0.49 * length) / length
            ends.append([c + w * share for c, w in zip(corner, way)])
        for k in range(steps + 1):
            t = k / steps
            rounded.append(
                tuple((1 - t)**2 * a + 2 * t * (1 - t) * c + t * t * b
                      for a, c, b in zip(ends[0], corner, ends[1])))
    return rounded + [points[-1]]


def lathe(profile, sides=48, crease=35):
    """Returns the surface that a profile of (radius, height) makes around +y.

    Its front is on the right of the profile's direction: upwards outside. Corners above `crease`
    degrees stay sharp.
    """
    mesh = Mesh()
    lengths = [0.0]
    for (r0, y0), (r1, y1) in zip(profile, profile[1:]):
        lengths.append(lengths[-1] + math.hypot(r1 - r0, y1 - y0))
    facing = []
    for (r0, y0), (r1, y1) in zip(profile, profile[1:]):
        length = math.hypot(r1 - r0, y1 - y0) or 1.0
        facing.append(((y1 - y0) / length, (r0 - r1) / length))

    def normal(here, other):
        if other is None or here[0] * other[0] + here[1] * other[1] < cos(math.radians(crease)):
            return here
        return (here[0] + other[0], here[1] + other[1])

    def ring(at, facing_at):
        r, y = profile[at]
        return [
            mesh.vertex(
                (r * cos(tau * k / sides), y, r * sin(tau * k / sides)),
                (facing_at[0] * cos(tau * k / sides), facing_at[1], facing_at[0] * sin(tau * k / sides)),
                (1 - k / sides, 1 - lengths[at] / lengths[-1])) for k in range(sides + 1)
        ]

    last, last_normal = None, None
    for k, here in enumerate(facing):
        start = normal(here, facing[k - 1] if k else None)
        end = normal(here, facing[k + 1] if k + 1 < len(facing) else None)
        low = last if last_normal == start else ring(k, start)
        last, last_normal = ring(k + 1, end), end
        mesh.grid([low, last])
    return mesh


def rounded_box(width, height, depth, radius, steps=3, puff=0.0):
    """Returns a box around the origin with round edges; `puff` bulges its large sides."""
    half = (width / 2, height / 2, depth / 2)
    radius = min(radius, *half)
    middle = 6 if puff else 1

    def line(h):
        ends = [h - radius + radius * math.tan(pi / 4 * k / steps) for k in range(steps + 1)]
        inner = [lerp(-(h - radius), h - radius, k / middle) for k in range(1, middle)]
        return [-e for e in reversed(ends)] + inner + ends

    mesh = Mesh()
    for axis in range(3):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        for side in (-1, 1):
            rows = []
            for a in line(half[i]):
                row = []
                for b in line(half[j]):
                    p = [0.0, 0.0, 0.0]
                    p[axis], p[i], p[j] = side * half[axis], a, b
                    core = [max(-(h - radius), min(h - radius, c)) for c, h in zip(p, half)]
                    n = unit(tuple(c - d for c, d in zip(p, core)))
                    q = add(tuple(core), mul(n, radius))
                    if puff:
                        u, v = q[0] / half[0], q[2] / half[2]
                        bulge = puff * max(0.0, 1 - u * u)**0.6 * max(0.0, 1 - v * v)**0.6
                        q = (q[0], q[1] + bulge * q[1] / half[1], q[2])
                    row.append(mesh.vertex(q, n, (p[i], p[j])))
                rows.append(row)
            mesh.grid(rows)
    return renormal(mesh) if puff else mesh


def renormal(mesh):
    """Returns the mesh with normals from its triangles, smooth across equal positions."""
    sums = {}

    def key(p):
        return tuple(round(c, 6) for c in p)

    for triangle in mesh.triangles:
        p, q, r = (mesh.positions[i] for i in triangle)
        face = cross(sub(q, p), sub(r, p))
        for i in triangle:
            at = key(mesh.positions[i])
            sums[at] = add(sums.get(at, (0.0, 0.0, 0.0)), face)
    mesh.normals = [unit(sums.get(key(p), n)) for p, n in zip(mesh.positions, mesh.normals)]
    return mesh


def surface(function, across, down, closed=False):
    """Returns the surface of a function of (u, v) from 0 to 1, with normals by differences."""
    mesh, step = Mesh(), 1e-4
    rows = []
    for j in range(down + 1):
        row = []
        for i in range(across + 1):
            u, v = i / across, j / down
            u0, u1 = (u - step, u + step) if closed else (max(0, u - step), min(1, u + step))
            v0, v1 = max(0, v - step), min(1, v + step)
            n = cross(sub(function(u1, v), function(u0, v)), sub(function(u, v1), function(u, v0)))
            if dot(n, n) < 1e-26:
                inside = min(1 - 1e-3, max(1e-3, v))
                n = cross(sub(function(u + step, inside), function(u - step, inside)),
                          sub(function(u, inside + step), function(u, inside - step)))
            row.append(mesh.vertex(function(u, v), n, (u, v)))
        rows.append(row)
    mesh.grid(rows)
    return mesh


def tube(path, radius, sides=10):
    """Returns a tube along a path, with a radius or a function of 0 to 1; its ends are closed."""
    mesh, rows = Mesh(), []
    side = None
    for k, p in enumerate(path):
        along = unit(sub(path[min(k + 1, len(path) - 1)], path[max(k - 1, 0)]))
        if side is None:
            side = cross(along, (0, 0, 1) if abs(along[2]) < 0.9 else (1, 0, 0))
        side = unit(sub(side, mul(along, dot(side, along))))
        other = cross(along, side)
        r = radius(k / (len(path) - 1)) if callable(radius) else radius
        rows.append([])
        for j in range(sides + 1):
            n = add(mul(side, cos(tau * j / sides)), mul(other, sin(tau * j / sides)))
            rows[-1].append(mesh.vertex(add(p, mul(n, r)), n, (j / sides, k / (len(path) - 1))))
        if k in (0, len(path) - 1):
            n = mul(along, -1 if k == 0 else 1)
            middle = mesh.vertex(p, n)
            rim = [mesh.vertex(mesh.positions[i], n) for i in rows[-1]]
            for a, b in zip(rim, rim[1:]):
                mesh.triangle(middle, a, b)
    mesh.grid(rows)
    return mesh


def ball(radius, sides=24):
    """Returns a sphere around the origin."""
    return lathe([(radius * sin(pi * k / (sides // 2)), -radius * cos(pi * k / (sides // 2)))
                  for k in range(sides // 2 + 1)], sides, 60)


def disc(radius, sides=32):
    """Returns a disc that faces +y, textured once."""
    mesh = Mesh()
    middle = mesh.vertex((0, 0, 0), (0, 1, 0), (0.5, 0.5))
    rim = [
        mesh.vertex((radius * cos(tau * k / sides), 0, radius * sin(tau * k / sides)), (0, 1, 0),
                    (0.5 + 0.5 * cos(tau * k / sides), 0.5 + 0.5 * sin(tau * k / sides)))
        for k in range(sides + 1)
    ]
    for a, b in zip(rim, rim[1:]):
        mesh.triangle(middle, a, b)
    return mesh


def panel(width, height):
    """Returns an upright quad around the origin that faces +z, textured once."""
    mesh = Mesh()
    corners = [(-1, -1, 0, 1), (1, -1, 1, 1), (1, 1, 1, 0), (-1, 1, 0, 0)]
    mesh.quad(*(mesh.vertex((x * width / 2, y * height / 2, 0), (0, 0, 1), (u, v)) for x, y, u, v in corners))
    return mesh


# Files --------------------------------------------------------------------------------------------


class Model:
    """A binary glTF file: meshes by material, and instances of them."""

    def __init__(self):
        self.parts, self.materials, self.textures, self.instances = {}, {}, [], None

    def material(self,
                 name,
                 color=(1, 1, 1),
                 metallic=0.0,
                 roughness=0.5,
                 texture=None,
                 normal=None,
                 emission=None,
                 strength=1.0,
                 glow=None,
                 **extensions):
        """Adds a material. Colours are linear; extensions are those of KHR_materials."""
        pbr = {"baseColorFactor": [*color, 1], "metallicFactor": metallic, "roughnessFactor": roughness}
        stated = {"name": name, "pbrMetallicRoughness": pbr}
        if texture:
            pbr["baseColorTexture"] = {"index": self.texture(texture)}
        if normal:
            stated["normalTexture"] = {"index": self.texture(normal[0]), "scale": normal[1]}
        if emission:
            stated["emissiveFactor"] = list(emission)
            extensions["emissive_strength"] = {"emissiveStrength": strength}
        if glow:
            stated["emissiveTexture"] = {"index": self.texture(glow)}
        if extensions:
            stated["extensions"] = {f"KHR_materials_{key}": value for key, value in extensions.items()}
        self.materials[name] = stated

    def texture(self, file):
        """Returns the index of an image file beside the model."""
        if file not in self.textures:
            self.textures.append(file)
        return self.textures.index(file)

    def add(self, material, mesh):
        """Adds a mesh to those of a material."""
        self.parts.setdefault(material, []).append(mesh)

    def write(self, name, uvs=False):
        """Writes the file, with texture coordinates where a material has textures, or of all meshes."""
        views, accessors, data = [], [], bytearray()

        def accessor(values, kind, component, form, target=None, normalized=False):
            width = 3 if kind == "VEC3" and form in "Hh" else 0
            flat = [c for value in values for c in (value if isinstance(value, tuple) else (value, ))]
            if width:  # Rows of three shorts start at multiples of four bytes.
                flat = [c for k in range(0, len(flat), 3) for c in (*flat[k:k + 3], 0)]
            raw = struct.pack(f"<{len(flat)}{form}", *flat)
            view = {"buffer": 0, "byteOffset": len(data), "byteLength": len(raw)}
            if target:
                view["target"] = target
            if width:
                view["byteStride"] = 8
            data.extend(raw + bytes(-len(raw) % 4))
            views.append(view)
            stated = {
                "bufferView": len(views) - 1, "componentType": component, "count": len(values), "type": kind
            }
            if normalized:
                stated["normalized"] = True
            accessors.append(stated)
            return len(accessors) - 1

        every = [p for meshes in self.parts.values() for mesh in meshes for p in mesh.positions]
        low = tuple(min(p[i] for p in every) for i in range(3))
        size = max(p[i] - low[i] for p in every for i in range(3))

        def positions(values):
            shorts = [tuple(round((c - l) / size * 65535) for c, l in zip(p, low)) for p in values]
            index = accessor(shorts, "VEC3", 5123, "H", 34962, True)
            accessors[index]["min"] = [min(p[i] for p in shorts) for i in range(3)]
            accessors[index]["max"] = [max(p[i] for p in shorts) for i in range(3)]
            return index

        def directions(values):
            return accessor([tuple(round(32767 * c) for c in n) for n in values], "VEC3", 5122, "h", 34962,
                            True)

        names = list(self.materials)
        primitives = []
        for material, meshes in self.parts.items():
            textured = uvs or "Texture" in json.dumps(self.materials[material])
            whole, known = Mesh(), {}
            for mesh in meshes:  # Vertices that are equal are stored once.
                index = []
                for p, n, uv in zip(mesh.positions, mesh.normals, mesh.uvs):
                    uv = uv if textured else (0.0, 0.0)
                    same = (*(round(c * 65535 / size) for c in p), *(round(c * 255) for c in n), *uv)
                    if same not in known:
                        known[same] = whole.vertex(p, n, uv)
                    index.append(known[same])
                whole.triangles += [tuple(index[i] for i in t) for t in mesh.triangles]
            attributes = {"POSITION": positions(whole.positions), "NORMAL": directions(whole.normals)}
            if textured:
                attributes["TEXCOORD_0"] = accessor(whole.uvs, "VEC2", 5126, "f", 34962)
            component, form = (5123, "H") if len(whole.positions) < 65536 else (5125, "I")
            indices = [i for triangle in whole.triangles for i in triangle]
            primitives.append({
                "attributes": attributes, "material": names.index(material), "indices":
                accessor(indices, "SCALAR", component, form, 34963)
            })
        # The shorts are from 0 to 1: a node scales and moves them to where they belong.
        nodes = [{"name": name, "mesh": 0, "translation": list(low), "scale": [size] * 3}]
        used = sorted({e for m in self.materials.values() for e in m.get("extensions", {})})
        used.append("KHR_mesh_quantization")
        if self.instances:
            # The node's scale and translation come after the instance's: they are taken back here.
            moves = [mul(sub(add(p, rotated(q, low)), low), 1 / size) for p, q in self.instances]
            turns = [tuple(round(32767 * c) for c in q) for _, q in self.instances]
            nodes[0]["extensions"] = {
                "EXT_mesh_gpu_instancing": {
                    "attributes": {
                        "TRANSLATION": accessor(moves, "VEC3", 5126, "f"), "ROTATION":
                        accessor(turns, "VEC4", 5122, "h", None, True)
                    }
                }
            }
            used.append("EXT_mesh_gpu_instancing")
        document = {
            "asset":
            {"version": "2.0", "generator": "Trisect, scenes/gallery/make.py", "copyright":
             "CC0-1.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": nodes, "meshes":
            [{"name": name, "primitives": primitives}], "materials": list(self.materials.values()),
            "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(data)}]
        }
        document["extensionsUsed"] = used
        document["extensionsRequired"] = ["KHR_mesh_quantization"]
        if self.textures:
            document["images"] = [{"uri": file} for file in self.textures]
            document["samplers"] = [{"wrapS": 10497, "wrapT": 10497}]
            document["textures"] = [{"source": k, "sampler": 0} for k in range(len(self.textures))]
        text = json.dumps(document, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        length = 12 + 8 + len(text) + 8 + len(data)
        (HERE / f"{name}.glb").write_bytes(
            struct.pack("<4sII", b"glTF", 2, length) + struct.pack("<I4s", len(text), b"JSON") + text +
            struct.pack("<I4s", len(data), b"BIN\0") + bytes(data))


def write_png(name, width, height, pixel, palette=None):
    """Writes a PNG of rows from the top; `pixel(x, y)` is a triple of bytes, or an index."""

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    rows = bytearray()
    previous = bytes(width * 3)
    for y in range(height):
        if palette:
            rows += b"\0" + bytes(pixel(x, y) for x in range(width))
        else:
            row = bytes(c for x in range(width) for c in pixel(x, y))
            rows += b"\2" + bytes((a - b) & 255 for a, b in zip(row, previous))
            previous = row
    body = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 3 if palette else 2, 0, 0, 0))
    if palette:
        body += chunk(b"PLTE", bytes(c for color in palette for c in color))
    body += chunk(b"IDAT", zlib.compress(bytes(rows), 9)) + chunk(b"IEND", b"")
    (HERE / f"{name}.png").write_bytes(b"\x89PNG\r\n\x1a\n" + body)


def write_hdr(name, width, height, radiance):
    """Writes a panorama in the format of Radiance; `radiance(x, y)` is linear."""
    body = bytearray()
    for y in range(height):
        for x in range(width):
            color = radiance(x, y)
            exponent = math.frexp(max(color))[1]
            body += bytes([*(int(c * 2.0**(8 - exponent)) for c in color), exponent + 128])
    (HERE /
     f"{name}.hdr").write_bytes(f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n".encode() +
                                body)


# Textures -----------------------------------------------------------------------------------------


class Noise:
    """Periodic value noise in two dimensions, from 0 to 1."""

    def __init__(self, seed):
        table = random.Random(seed)
        self.values = [table.random() for _ in range(4096)]

    def at(self, x, y, period_x, period_y):
        """Returns the noise at a point of a lattice of whole periods."""
        i, j = math.floor(x), math.floor(y)
        s, t = x - i, y - j
        s, t = s * s * (3 - 2 * s), t * t * (3 - 2 * t)

        def value(a, b):
            return self.values[((a % period_x) * 61 + (b % period_y) * 1307) & 4095]

        return lerp(lerp(value(i, j), value(i + 1, j), s), lerp(value(i, j + 1), value(i + 1, j + 1), s), t)

    def sum(self, u, v, across, down, octaves):
        """Returns a sum of octaves of u and v from 0 to 1, from 0 to 1."""
        total = weight = 0.0
        for k in range(octaves):
            share = 0.55**k
            total += share * self.at(u * across, v * down, across, down)
            weight += share
            across, down = across * 2, down * 2
        return total / weight


def ramp(colors, count):
    """Returns a palette of `count` colours through the given ones, all in sRGB bytes."""
    palette = []
    for k in range(count):
        at = k / (count - 1) * (len(colors) - 1)
        i = min(int(at), len(colors) - 2)
        palette.append(tuple(round(lerp(a, b, at - i)) for a, b in zip(colors[i], colors[i + 1])))
    return palette


def wood(name, seed, planks, colors, size=512, contrast=0.3, gap=2):
    """Writes planks along v, each with a grain and a tone of its own."""
    noise, tone = Noise(seed), random.Random(seed + 1)
    tones = [tone.uniform(-contrast, contrast) / 2 for _ in range(planks * 2)]
    ends = [tone.randrange(size) for _ in range(planks)]
    levels = 40

    def pixel(x, y):
        plank = x * planks // size
        inside = x - plank * size // planks
        along = (y - ends[plank]) % size
        board = plank * 2 + (along > size // 2)
        if gap and (inside < gap or along % (size // 2 + 1) < gap):
            return 0
        u, v = x / size, y / size
        shift = board * 0.37 % 1
        warp = noise.sum(u, (v + shift) % 1, 3 * planks, 2, 2)
        rings = 0.5 + 0.5 * sin(tau * (inside * planks / size * 2.5 + 3.5 * warp + board))
        fibre = noise.sum(u, (v + shift) % 1, 128, 4, 2)
        tint = 0.5 + tones[board] + 0.22 * (rings - 0.5) + 0.5 * (fibre - 0.5)
        return 1 + max(0, min(levels - 2, round(tint * (levels - 2))))

    dark = tuple(round(c * 0.35) for c in colors[0])
    write_png(name, size, size, pixel, [dark] + ramp(colors, levels - 1))


def normal_map(name, size, height, strength):
    """Writes the normal map of a periodic height of (x, y) in pixels."""
    field = [[height(x, y) for x in range(size)] for y in range(size)]

    def pixel(x, y):
        slope_x = (field[y][(x + 1) % size] - field[y][x - 1]) * strength
        slope_y = (field[(y + 1) % size][x] - field[y - 1][x]) * strength
        n = unit((-slope_x, slope_y, 1.0))
        return tuple(round(127.5 * c + 127.5) for c in n)

    write_png(name, size, size, pixel)


# The still life, in decimetres -------------------------------------------------------------------


def one(name, mesh, uvs=False):
    """Writes a model of one mesh, whose material the scene states."""
    model = Model()
    model.material("default")
    model.add("default", mesh)
    model.write(name, uvs)


def vessel(name, outside, inside, level, sides=56):
    """Writes a glass vessel and the liquid in it, up to a height.

    The glass is the surface between glass and air, the liquid that between liquid and glass,
    seen from the glass. The scene covers the liquid with a disc.
    """
    above = [p for p in inside if p[1] > level]
    below = [p for p in inside if p[1] <= level]
    (r0, y0), (r1, y1) = above[-1], below[0]
    edge = (lerp(r0, r1, (level - y0) / (y1 - y0)), level)
    one(name, lathe(outside + above + [edge], sides, 50))
    one(f"{name}_liquid", lathe(list(reversed([edge] + below)), sides, 50))


def still_life():
    """Writes the models of the still life."""
    foot = bevel([(0, 0), (0.37, 0), (0.37, 0.022), (0.3, 0.035)], 0.02)
    outside = foot[:-1] + smooth([(0.3, 0.035), (0.12, 0.075), (0.05, 0.16), (0.036, 0.5), (0.04, 0.85),
                                  (0.075, 0.97), (0.22, 1.08), (0.37, 1.28), (0.43, 1.55), (0.405, 1.85),
                                  (0.35, 2.16)], 3)
    inside = smooth([(0.334, 2.165), (0.39, 1.85), (0.415, 1.55), (0.355, 1.29), (0.21, 1.105), (0.07, 1.035),
                     (0, 1.03)], 3)
    vessel("wine_glass", outside + [(0.345, 2.168), (0.339, 2.17)], inside, 1.49)

    outside = bevel([(0, 0), (0.5, 0), (0.53, 0.06)], 0.04)[:-1] + smooth([(0.53, 0.06), (0.58, 0.3),
                                                                           (0.56, 0.62), (0.4, 1.0),
                                                                           (0.22, 1.36), (0.175, 1.7),
                                                                           (0.185, 2.0), (0.25, 2.3)], 3)
    inside = smooth([(0.232, 2.305), (0.165, 2.0), (0.153, 1.7), (0.197, 1.36), (0.372, 1.0), (0.532, 0.62),
                     (0.552, 0.3), (0.5, 0.11), (0.4, 0.075), (0, 0.09)], 3)
    vessel("carafe", outside + [(0.245, 2.312), (0.238, 2.312)], inside, 1.12)

    wall = smooth([(0.3, 0.06), (0.31, 0.1), (0.5, 0.17), (0.72, 0.35), (0.84, 0.58)], 3)
    inner = smooth([(0.81, 0.57), (0.69, 0.36), (0.48, 0.205), (0.25, 0.15), (0, 0.145)], 3)
    bowl = lathe([(0, 0.02), (0.26, 0.02), (0.3, 0), (0.33, 0),
                  (0.33, 0.02)] + wall + [(0.845, 0.592), (0.838, 0.6), (0.82, 0.595)] + inner, 60)
    one("bowl", bowl)

    shell = smooth([(0.04, 0.0), (0.3, 0.03), (0.36, 0.12), (0.37, 0.3), (0.28, 0.55), (0.235, 0.72),
                    (0.27, 0.88)], 3)
    lining = smooth([(0.255, 0.885), (0.222, 0.72), (0.265, 0.55), (0.35, 0.3), (0.33, 0.1), (0, 0.05)], 3)
    one("pot", lathe([(0, 0)] + shell + lining, 56))
    handle = smooth([(-0.23, 0.74, 0), (-0.36, 0.79, 0), (-0.7, 0.9, 0), (-0.98, 0.97, 0)], 6)
    one("pot_handle", tube(handle, lambda t: 0.028 + 0.022 * t, 14) + ball(0.055, 14).move(-0.99, 0.973, 0))

    cup = bevel([(0, 0.03), (0.17, 0.03), (0.18, 0),
                 (0.21, 0), (0.22, 0.03)], 0.01)[:-1] + smooth([(0.22, 0.03), (0.31, 0.14), (0.36, 0.34),
                                                                (0.375, 0.56)], 3)
    lining = smooth([(0.352, 0.56), (0.338, 0.34), (0.29, 0.17), (0.2, 0.08), (0, 0.07)], 3)
    ear = smooth([(0.35, 0.47, 0), (0.48, 0.5, 0), (0.57, 0.4, 0), (0.52, 0.24, 0), (0.41, 0.17, 0),
                  (0.32, 0.18, 0)], 3)
    one("cup", (lathe(cup + [(0.372, 0.572), (0.364, 0.576), (0.356, 0.572)] + lining, 52) +
                tube(ear, lambda t: 0.032 + 0.012 * abs(2 * t - 1), 12).scale(1, 1, 1.25)).move(0, 0.075, 0))
    plate = bevel([(0, 0.02), (0.3, 0.02), (0.31, 0), (0.34, 0), (0.36, 0.03), (0.66, 0.1), (0.675, 0.115),
                   (0.65, 0.12), (0.36, 0.06), (0.26, 0.055), (0.25, 0.075), (0, 0.075)], 0.012, 2)
    one("saucer", lathe(plate, 56))

    half = [(0.0, -0.5), (0.035, -0.495), (0.06, -0.46), (0.09, -0.42), (0.19, -0.35), (0.28, -0.22),
            (0.315, -0.05), (0.31, 0.1), (0.26, 0.25), (0.16, 0.37), (0.08, 0.43), (0.05, 0.47), (0.0, 0.48)]
    dents = Noise(7)

    def dent(p):
        at = math.atan2(p[2], p[0]) / tau % 1
        return mul(p, 0.97 + 0.06 * dents.sum(at, (p[1] + 0.5) % 1, 5, 3, 2))

    one("lemon", renormal(lathe(smooth(half, 3), 40).map(dent)), uvs=True)

    def cloth(u, v):
        x, z = (u - 0.5) * 1.9, (v - 0.5) * 4.6
        fold = 0.018 * sin(5 * x + 1.3 * sin(1.7 * z)) * sin(0.9 * z + 0.5)**2 + 0.012 * sin(3.1 * z + 2 * x)
        return (x + 0.05 * sin(1.4 * z), 0.032 + fold, z + 0.04 * sin(2.3 * x))

    one("cloth", surface(cloth, 28, 64), uvs=True)

    wood("walnut", 11, 5, [(62, 38, 24), (104, 66, 40), (146, 100, 64)], contrast=0.3)
    pores = Noise(5)
    normal_map("peel", 128, lambda x, y: -max(0.0, pores.sum(x / 128, y / 128, 26, 26, 1) - 0.5)**1.2, 2.2)

    def linen(x, y):
        if 8 <= x % 128 < 14 or 18 <= x % 128 < 20:
            return 4 + (x + y) % 2
        slub = random.Random(x // 2 * 911 + y // 2).random() < 0.2
        return (x % 4 < 2) ^ (y % 4 < 2) ^ (slub + 2 * (x % 7 == 0))

    write_png("linen", 128, 128, linen, [(216, 205, 186), (226, 217, 200), (208, 196, 176), (220, 209, 190),
                                         (86, 98, 116), (98, 110, 128)])


# The camera of the product shot, in centimetres --------------------------------------------------


def slab(width, depth, corner, profile, steps=10):
    """Returns an upright body over a rectangle with round corners.

    The profile has pairs of (inset, height) from the bottom to the top, where both ends are closed.
    """
    plan = []
    for k, (sx, sz) in enumerate([(1, 1), (-1, 1), (-1, -1), (1, -1)]):
        for j in range(steps + 1):
            angle = pi / 2 * (k + j / steps)
            plan.append((sx * (width / 2 - corner), sz * (depth / 2 - corner), cos(angle), sin(angle)))
    plan.append(plan[0])
    mesh, along = Mesh(), [0.0]
    for (x0, z0, a0, b0), (x1, z1, a1, b1) in zip(plan, plan[1:]):
        along.append(along[-1] +
                     math.hypot(x1 + a1 * corner - x0 - a0 * corner, z1 + b1 * corner - z0 - b0 * corner))
    last = None
    for k, ((i0, y0), (i1, y1)) in enumerate(zip(profile, profile[1:])):
        rows = []
        for at, (inset, y) in ((k, (i0, y0)), (k + 1, (i1, y1))):
            slopes = [(profile[m + 1][1] - profile[m][1], profile[m + 1][0] - profile[m][0])
                      for m in (at - 1, at) if 0 <= m < len(profile) - 1]
            own = (y1 - y0, i1 - i0)
            slopes = [unit((*s, 0)) for s in slopes]
            own = unit((*own, 0))
            sum_of = (0.0, 0.0, 0.0)
            for s in slopes:
                if dot(s, own) > 0.6:
                    sum_of = add(sum_of, s)
            rows.append([
                mesh.vertex((x + a * (corner - inset), y, z + b * (corner - inset)),
                            (a * sum_of[0], sum_of[1], b * sum_of[0]), (length, -y))
                for (x, z, a, b), length in zip(plan, along)
            ])
        mesh.grid(rows)
    for (inset, y), up in ((profile[0], -1), (profile[-1], 1)):
        middle = mesh.vertex((0, y, 0), (0, up, 0))
        rim = [
            mesh.vertex((x + a * (corner - inset), y, z + b * (corner - inset)), (0, up, 0), (x, z))
            for x, z, a, b in plan
        ]
        for a, b in zip(rim, rim[1:]):
            mesh.triangle(middle, a, b)
    return mesh


def round_profile(y0, y1, edge, steps=4):
    """Returns a profile of `slab` with round edges at bottom and top."""
    low = [(edge * (1 - sin(pi / 2 * k / steps)), y0 + edge * (1 - cos(pi / 2 * k / steps)))
           for k in range(steps + 1)]
    return low + [(inset, y0 + y1 - y) for inset, y in reversed(low)]


def knurled(radius, y0, y1, teeth, depth, edge=0.06, duty=0.5):
    """Returns a closed cylinder around +y with teeth around its side."""
    mesh, per = Mesh(), 5
    count = teeth * per
    shape = []
    for k in range(count):
        phase = k % per / per
        inside = 0.5 - 0.5 * cos(tau * phase)
        shape.append(radius - depth * min(1.0, max(0.0, (inside - duty / 2) * 2.2)))
    rows = []
    for inset, y in ((edge, y0), (0.0, y0 + edge), (0.0, y1 - edge), (edge, y1)):
        row = []
        for k in range(count + 1):
            r = shape[k % count]
            slope = (shape[(k + 1) % count] - shape[k % count - 1]) / (2 * tau / count * r)
            angle = tau * k / count
            n = (cos(angle) + slope * sin(angle), 0, sin(angle) - slope * cos(angle))
            n = add(n, (0, {y0: -1, y1: 1}.get(y, 0.0), 0))
            row.append(mesh.vertex(((r - inset) * cos(angle), y, (r - inset) * sin(angle)), n,
                                   (k / count, 0)))
        rows.append(row)
    mesh.grid(rows)
    for row, up in ((rows[0], -1), (rows[-1], 1)):
        middle = mesh.vertex((0, mesh.positions[row[0]][1], 0), (0, up, 0))
        rim = [mesh.vertex(mesh.positions[i], (0, up, 0)) for i in row]
        for a, b in zip(rim, rim[1:]):
            mesh.triangle(middle, a, b)
    return mesh


FONT = {  # Rows of three bits from the top.
    "0": (7, 5, 5, 5, 7), "1": (2, 6, 2, 2, 7), "2": (7, 1, 7, 4, 7), "3": (7, 1, 3, 1, 7), "4": (5, 5, 7, 1, 1),
    "5": (7, 4, 7, 1, 7), "6": (7, 4, 7, 5, 7), "7": (7, 1, 2, 2, 2), "8": (7, 5, 7, 5, 7), "9": (7, 5, 7, 1, 7),
    ".": (0, 0, 0, 0, 2), " ": (0, 0, 0, 0, 0), "T": (7, 2, 2, 2, 2), "R": (6, 5, 6, 5, 5), "I": (7, 2, 2, 2, 7),
    "S": (7, 4, 7, 1, 7), "E": (7, 4, 6, 4, 7), "C": (7, 4, 4, 4, 7), "m": (0, 7, 7, 5, 5), "f": (3, 2, 7, 2, 2),
    "/": (1, 1, 2, 4, 4), ":": (0, 2, 0, 2, 0), "A": (2, 5, 7, 5, 5), "N": (5, 7, 7, 7, 5), "-": (0, 0, 7, 0, 0),
}


def label(name,
          width,
          height,
          texts,
          ticks=(),
          size=2,
          colors=((12, 12, 13), (222, 220, 212), (214, 92, 40))):
    """Writes an image with texts of (x, y, text, colour), and ticks of (x, y0, y1, colour)."""
    pixels = [[0] * width for _ in range(height)]
    for left, top, text, color in texts:
        for letter in text:
            for row, bits in enumerate(FONT[letter]):
                for column in range(3):
                    if bits >> (2 - column) & 1:
                        for dy in range(size):
                            for dx in range(size):
                                pixels[top + row * size + dy][(left + column * size + dx) % width] = color
            left += 4 * size
    for x, y0, y1, color in ticks:
        for y in range(y0, y1):
            for dx in range(size):
                pixels[y][(x + dx) % width] = color
    write_png(name, width, height, lambda x, y: pixels[y][x], list(colors))


def camera():
    """Writes the camera of the product shot, which looks along +z and stands on y = 0."""
    cells = random.Random(3)
    grid = 22
    seeds = [[(cells.random(), cells.random()) for _ in range(grid)] for _ in range(grid)]

    def grain(x, y):
        u, v = x / 256 * grid, y / 256 * grid
        near = []
        for j in range(-1, 2):
            for i in range(-1, 2):
                a, b = math.floor(u) + i, math.floor(v) + j
                px, py = seeds[b % grid][a % grid]
                near.append(math.hypot(a + px - u, b + py - v))
        near.sort()
        return min(0.45, near[1] - near[0])

    normal_map("leather", 256, grain, 1.6)

    marks = [(k * 64 + 6, 6, text, 1)
             for k, text in enumerate(["0.7", "0.8", "1", "1.2", "1.5", "2", "3", "5", "10"] * 2) if k < 16]
    label("scale", 1024, 32, marks, [(k * 16 + 14, 22, 30 if k % 4 == 0 else 26, 1) for k in range(64)])
    stops = [(k * 48 + 4, 4, text, 2 if text == "8" else 1) for k, text in enumerate([
        "2", "2.8", "4", "5.6", "8", "11", "16", "16", "11", "8", "5.6", "4", "2.8", "2", "2.8", "4", "5.6",
        "8", "11", "16", "16"
    ])]
    label("stops", 1024, 24, stops, [(k * 24 + 8, 18, 23, 1) for k in range(42)])
    label("ring", 1024, 32, [(40, 10, "TRISECT  1:2  50 mm", 1), (560, 10, "TRISECT  1:2  50 mm", 1)], size=3)

    model = Model()
    model.material("chrome", (0.78, 0.77, 0.75), 1.0, 0.27)
    model.material("bright", (0.86, 0.85, 0.84), 1.0, 0.12)
    model.material("leather", (0.022, 0.02, 0.019), 0.0, 0.42, normal=("leather.png", 1.0))
    model.material("black", (0.012, 0.012, 0.013),
                   0.0,
                   0.38,
                   clearcoat={"clearcoatFactor": 0.6, "clearcoatRoughnessFactor": 0.25})
    model.material("anodised", (0.05, 0.05, 0.053), 1.0, 0.36)
    model.material("scale", (1, 1, 1), 0.0, 0.4, texture="scale.png")
    model.material("stops", (1, 1, 1), 0.0, 0.4, texture="stops.png")
    model.material("ring", (1, 1, 1), 0.0, 0.45, texture="ring.png")
    model.material(
        "window", (0.01, 0.012, 0.016),
        0.0,
        0.04,
        clearcoat={"clearcoatFactor": 1.0},
        iridescence={"iridescenceFactor": 0.12, "iridescenceIor": 1.38, "iridescenceThicknessMaximum": 240})
    model.material("element", (1, 1, 1),
                   0.0,
                   0.0,
                   transmission={"transmissionFactor": 1.0},
                   volume={"thicknessFactor": 1.0},
                   ior={"ior": 1.6},
                   iridescence={
                       "iridescenceFactor": 1.0, "iridescenceIor": 1.38, "iridescenceThicknessMinimum": 270,
                       "iridescenceThicknessMaximum": 270
                   })
    model.material(
        "coated", (0.01, 0.004, 0.02),
        0.0,
        0.04,
        clearcoat={"clearcoatFactor": 1.0},
        iridescence={"iridescenceFactor": 1.0, "iridescenceIor": 1.6, "iridescenceThicknessMaximum": 330})
    model.material("red", (0.62, 0.03, 0.02),
                   0.0,
                   0.3,
                   clearcoat={"clearcoatFactor": 1.0, "clearcoatRoughnessFactor": 0.05})

    # Body: base plate, leather, top plate with its step.
    model.add("anodised", slab(13.6, 3.3, 1.6, round_profile(0.0, 0.85, 0.14)))
    skin = slab(13.5, 3.2, 1.56, [(0.02, 0.83), (0.0, 0.86), (0.0, 5.54), (0.02, 5.57)])
    skin.uvs = [(u / 3.2, v / 3.2) for u, v in skin.uvs]
    model.add("leather", skin)
    model.add("chrome", slab(13.6, 3.3, 1.6, round_profile(5.55, 7.1, 0.16)))
    model.add("chrome", slab(8.6, 3.0, 0.5, round_profile(6.9, 7.75, 0.16)).move(-1.6, 0, 0))

    # Finder, patch and meter windows.
    for x, width in ((-5.0, 1.7), (-1.35, 1.1), (1.75, 0.75)):
        model.add("black", rounded_box(width + 0.28, 1.12, 0.2, 0.08).move(x, 6.72, 1.56))
        model.add("bright", rounded_box(width + 0.38, 1.22, 0.1, 0.05).move(x, 6.72, 1.6))
        model.add("window", rounded_box(width, 0.84, 0.1, 0.04, puff=0).move(x, 6.72, 1.64))

    # Hot shoe.
    model.add("black", rounded_box(2.0, 0.1, 1.9, 0.04).move(-1.6, 7.79, -0.1))
    for side in (-1, 1):
        model.add("bright", rounded_box(0.14, 0.28, 1.9, 0.05).move(-1.6 + side * 1.0, 7.87, -0.1))
        model.add("bright", rounded_box(0.4, 0.09, 1.9, 0.04).move(-1.6 + side * 0.87, 7.99, -0.1))

    # Shutter dial, release, advance lever, rewind knob.
    model.add("bright", knurled(0.92, 7.05, 7.62, 40, 0.06).move(3.75, 0, 0))
    model.add("black", lathe([(0, 7.64), (0.6, 7.64), (0.62, 7.6)][::-1], 40).move(3.75, 0, 0))
    model.add(
        "bright",
        lathe(
            bevel([(0.62, 7.1), (0.62, 7.28), (0.42, 7.34), (0.40, 7.42), (0.30, 7.42), (0.26, 7.38),
                   (0.0, 7.38)], 0.03, 2), 40).move(5.55, 0, 0.25))
    model.add("red", lathe([(0.24, 7.38), (0.24, 7.5), (0.2, 7.55), (0, 7.52)], 32).move(5.55, 0, 0.25))
    lever = slab(2.9, 0.62, 0.3, round_profile(7.3, 7.48, 0.06)).move(1.1, 0, 0).turn("y", -158)
    model.add("bright", lever.move(5.6, 0, -0.55))
    model.add("bright", lathe(bevel([(0.55, 7.1), (0.55, 7.56), (0.0, 7.58)], 0.06), 40).move(5.6, 0, -0.55))
    model.add("bright", knurled(0.72, 7.1, 7.75, 30, 0.07).move(-6.0 + 0.2, 0, -0.1).scale(1, 1, 1))

    # Self-timer lever, mount release, strap lugs.
    model.add("bright",
              lathe(bevel([(0.42, 0), (0.42, 0.24), (0, 0.26)], 0.06), 32).turn("x", 90).move(5.0, 4.4, 1.58))
    model.add(
        "bright",
        slab(1.9, 0.42, 0.2, round_profile(0, 0.2, 0.06)).turn("x", 90).turn("z", -80).move(4.93, 3.6, 1.74))
    model.add("red", ball(0.13, 16).move(-2.95, 4.95, 1.72))
    for side in (-1, 1):
        loop = [(side * (6.72 + 0.34 * sin(pi * k / 12)), 5.1 + 0.42 * cos(pi * k / 12), 0.55)
                for k in range(13)]
        model.add("bright", tube(loop, 0.075, 10))

    # Lens, built around +y from the mount outwards, then turned to +z.
    lens = []
    lens.append(("bright", lathe(bevel([(2.9, 0), (2.9, 0.28), (2.62, 0.34), (2.5, 0.34)], 0.05), 72)))
    lens.append(("anodised", lathe(bevel([(2.5, 0.2), (2.5, 0.62), (2.42, 0.66)], 0.03), 72)))
    lens.append(("scale", lathe([(2.5, 0.62), (2.44, 1.08)], 80)))
    lens.append(("anodised", knurled(2.62, 1.06, 1.86, 44, 0.1)))
    lens.append(("bright", lathe(bevel([(2.4, 1.8), (2.4, 1.98), (2.3, 2.0)], 0.03), 72)))
    lens.append(("stops", lathe([(2.34, 1.96), (2.34, 2.3)], 96)))
    lens.append(("anodised", knurled(2.42, 2.3, 2.72, 52, 0.06)))
    lens.append(
        ("anodised",
         lathe(bevel([(2.2, 2.7), (2.22, 3.3), (2.12, 3.34), (2.06, 3.3), (2.02, 3.06), (1.9, 3.04)], 0.03),
               96)))
    lens.append(("ring", lathe([(1.92, 3.05), (1.46, 2.86)], 96)))
    lens.append(
        ("black", lathe([(1.46, 2.87), (1.44, 2.55), (1.36, 2.55), (1.34, 2.1), (1.1, 2.1), (1.08, 1.5)],
                        72)))
    front = [(1.45 * sin(0.5 * k / 12) / sin(0.5),
              2.5 + 1.45 / sin(0.5) * (cos(0.5 * k / 12) - cos(0.5)) * 0.9) for k in range(13)]
    back = [(1.45 * k / 8, 2.42 + 0.06 * (k / 8)**2) for k in range(9)]
    lens.append(("element", lathe(back + front[::-1], 72)))
    lens.append(("coated",
                 lathe([(1.12 * sin(0.7 * k / 12) / sin(0.7), 1.5 + 1.1 * (cos(0.7 * k / 12) - cos(0.7)))
                        for k in range(13)][::-1], 64)))
    for material, mesh in lens:
        model.add(material, mesh.turn("x", 90).move(0.35, 3.35, 1.55))
    model.write("camera")

    # A sheet of paper that bends upwards behind the camera.
    one(
        "backdrop",
        surface(
            lambda u, v: (lerp(-60, 60, u), *(
                (0.0, lerp(60, -20, v / 0.5))
                if v < 0.5 else (16 * (1 - cos(pi / 2 * (v - 0.5) / 0.2)), -20 - 16 * sin(pi / 2 *
                                                                                          (v - 0.5) / 0.2))
                if v < 0.7 else (16 + 60 * (v - 0.7) / 0.3, -36))), 1, 60))


# Ten thousand lanterns over a lake, in metres -----------------------------------------------------


def lanterns():
    """Writes the lanterns with their instances, the lake, its shores, the jetty and the boat."""
    glow = ramp([(255, 200, 120), (255, 226, 160), (255, 170, 84), (236, 104, 40), (178, 62, 24)], 64)
    write_png("glow", 4, 64, lambda x, y: 63 - y, glow)
    dice = random.Random(2026)

    def quaternion(yaw, tilt, toward):
        turn = (0.0, sin(yaw / 2), 0.0, cos(yaw / 2))
        lean = (cos(toward) * sin(tilt / 2), 0.0, sin(toward) * sin(tilt / 2), cos(tilt / 2))
        x, y, z = add(add(mul(turn[:3], lean[3]), mul(lean[:3], turn[3])), cross(lean[:3], turn[:3]))
        return (x, y, z, lean[3] * turn[3] - dot(lean[:3], turn[:3]))

    path = smooth([(-30, 1, -150), (-52, 12, -118), (-36, 26, -84), (6, 37, -74), (44, 46, -88),
                   (62, 62, -130), (40, 84, -190)], 40)

    def place():
        kind = dice.random()
        if kind < 0.58:  # The stream that rises from the far shore.
            t = dice.random()**1.15
            p = path[min(int(t * len(path)), len(path) - 1)]
            wide = 3.5 + 13 * t
            return add(p, (dice.gauss(0, wide), dice.gauss(0, 0.55 * wide), dice.gauss(0, wide)))
        if kind < 0.955:  # Those that have left it.
            return (dice.gauss(0, 85), 3 + abs(dice.gauss(0, 36)), -16 - 250 * dice.random()**0.8)
        return (dice.uniform(-70, 70), 0.02, dice.uniform(-200, -14))  # Those that swim.

    def visible(p):
        return p[1] > 0.0 and p[2] < -11 and (p[1] > 1 or abs(p[0]) > 3)

    kinds = [("lantern_gold", 0.42, 4000, (1, 0.55, 0.2), 1.9),
             ("lantern_amber", 0.36, 4000, (1, 0.44, 0.13), 1.6),
             ("lantern_red", 0.46, 2000, (1, 0.34, 0.09), 1.3)]
    for name, radius, count, color, strength in kinds:
        model = Model()
        model.material("paper", (0.7, 0.5, 0.3), 0.0, 0.9, emission=color, strength=strength, glow="glow.png")
        shape = [(0.0, 0.02), (0.62, 0.0), (1.0, 1.65), (0.76, 2.25), (0.0, 2.42)]
        model.add("paper", lathe([(radius * r, radius * y) for r, y in shape], 7, 50))
        model.instances = []
        while len(model.instances) < count:
            p = place()
            if visible(p):
                calm = 0.2 if p[1] < 1 else 1
                model.instances.append(
                    (p, quaternion(dice.uniform(0, tau), calm * abs(dice.gauss(0, 0.13)),
                                   dice.uniform(0, tau))))
        model.write(name)

    def dusk(column, row, width=64, height=128):
        """Radiance after sunset: orange over the place of the sun, then rose, then deep blue."""
        up = sin(pi * (0.5 - (row + 0.5) / height))
        west = 0.5 + 0.5 * cos(tau * ((column + 0.5) / width - 0.47))
        stops = [(0.0, (0.34, 0.15, 0.075)), (0.05, (0.26, 0.125, 0.09)), (0.12, (0.13, 0.088, 0.11)),
                 (0.25, (0.048, 0.058, 0.11)), (0.5, (0.018, 0.03, 0.075)), (1.0, (0.006, 0.012, 0.036))]
        if up < 0:
            return (0.01, 0.01, 0.014)
        for (y0, c0), (y1, c1) in zip(stops, stops[1:]):
            if up <= y1:
                t = (up - y0) / (y1 - y0)
                near = max(0.0, 1 - up / 0.3)
                return tuple(lerp(a, b, t) * lerp(1, 0.25 + 0.9 * west**3, near) for a, b in zip(c0, c1))

    write_hdr("dusk", 64, 128, dusk)

    waves = Noise(21)

    def ripple(x, y):
        u, v = x / 256, y / 256
        return waves.sum(u, v, 7, 5, 4) + 0.5 * waves.sum(v, u, 5, 9, 3)

    normal_map("ripples", 256, ripple, 1.1)
    lake = Mesh()
    lake.quad(*(lake.vertex((x, 0, z), (0, 1, 0), (x / 9, z / 16))
                for x, z in ((-400, 20), (400, 20), (400, -420), (-400, -420))))
    one("lake", lake, uvs=True)

    ridge = Noise(9)

    def range_of(seed, depth, height, base):

        def at(u, v):
            x = lerp(-520, 520, u)
            rough = ridge.sum((u + seed) % 1, 0.37 * seed % 1, 9, 5, 6)
            top = base + height * rough**1.6 * (0.45 + 0.55 * (abs(x + 40) / 300)**0.9)
            return (x, -2 + (top + 2) * v, -depth - 60 * v)

        return at

    one("hills", surface(range_of(0.13, 330, 95, 6), 200, 2))
    one("mountains", surface(range_of(0.55, 420, 230, 20), 220, 2))

    model = Model()
    model.material("planks", (0.3, 0.21, 0.14), 0.0, 0.7)
    model.material("posts", (0.16, 0.11, 0.075), 0.0, 0.8)
    model.material("hull", (0.11, 0.035, 0.025), 0.0, 0.35)
    model.material("inside", (0.26, 0.16, 0.09), 0.0, 0.6)
    model.material("iron", (0.03, 0.03, 0.032), 1.0, 0.5)
    for k in range(52):
        model.add(
            "planks",
            rounded_box(2.3 + dice.uniform(-0.06, 0.06), 0.06, 0.29, 0.015,
                        1).turn("y", dice.uniform(-0.8, 0.8)).turn("z", dice.uniform(-0.4, 0.4)).move(
                            dice.uniform(-0.03, 0.03), 0.6 + dice.uniform(-0.008, 0.008), 9.0 - 0.315 * k))
    for z in (7.6, 4.2, 0.8, -2.6, -6.0, -7.0):
        for side in (-1, 1):
            tall = 1.75 if z in (0.8, -6.0, 4.2) else 0.95
            model.add(
                "posts",
                lathe(bevel([(0.1, -1), (0.1, tall), (0, tall + 0.03)], 0.03), 14).move(1.16 * side, 0, z))
            if tall > 1:
                model.add(
                    "iron",
                    tube([(1.16 * side, 1.66, z), (0.92 * side, 1.72, z), (0.8 * side, 1.66, z)], 0.02, 8))
                model.add("iron",
                          lathe([(0.0, 0.21), (0.11, 0.15), (0.1, 0.13)][::-1], 14).move(0.8 * side, 1.42, z))
                model.add(
                    "iron",
                    lathe([(0.0, -0.14), (0.08, -0.14), (0.08, -0.11), (0, -0.11)],
                          14).move(0.8 * side, 1.42, z))

    def hull(u, v):
        x = lerp(-1, 1, u)
        beam = 0.62 * max(0.0, 1 - abs(x)**2.6)**0.75 + 0.015
        angle = lerp(-pi / 2, pi / 2, v)
        rise = 0.22 * x * x + 0.03
        return (2.1 * x, 0.42 + rise - 0.6 * cos(angle) * (1 - 0.3 * x * x),
                beam * sin(angle) * (1 + 0.12 * cos(angle)))

    outer = surface(hull, 36, 14)
    if outer.normals[0][1] > 0:
        outer = outer.flip()
    inner = outer.scale(0.97, 0.95, 0.93).move(0, 0.03, 0).flip()
    for part, material in ((outer, "hull"), (inner, "inside")):
        model.add(material, part.turn("y", 28).move(4.3, -0.12, -3.6))
    for x in (-0.75, 0.25, 1.05):
        seat = rounded_box(0.28, 0.04, 1.06 if x < 1 else 0.9, 0.015, 1).move(x, 0.42, 0)
        model.add("inside", seat.turn("y", 28).move(4.3, -0.12, -3.6))
    model.write("jetty")


# The interior, in metres --------------------------------------------------------------------------


def interior():
    """Writes the furniture of the room, and its textures."""
    wood("oak", 31, 6, [(134, 92, 56), (178, 130, 84), (206, 164, 116)], contrast=0.34)

    def rug(x, y):
        border = min(x, 95 - x, y, 63 - y)
        if border in (3, 4, 9):
            return 1
        if border < 9:
            return 0 if border != 6 else 2
        d = (abs((x - 48) % 26 - 13) + abs((y - 32) % 26 - 13)) % 13
        return (3, 3, 0, 3, 2, 2, 3, 3, 1, 3, 3, 3, 0)[d]

    write_png("rug", 96, 64, rug, [(214, 200, 176), (52, 68, 88), (176, 92, 62), (150, 60, 46)])

    def picture(name, size, function):
        write_png(name, *size, function, [(236, 228, 212), (198, 106, 66), (38, 60, 72), (222, 170, 92),
                                          (120, 140, 128), (24, 28, 32), (232, 206, 178)])

    def sunset(x, y):
        if (x - 64)**2 + (y - 62)**2 < 30**2:
            return 1
        if y > 112 + 9 * sin(x / 17):
            return 2
        if y > 92 + 12 * sin(x / 23 + 2):
            return 4
        return 3 if y > 74 + 10 * sin(x / 31 + 1) else 0

    picture("picture_sun", (128, 160), sunset)

    def shapes(x, y):
        if (x - 44)**2 + (y - 56)**2 < 26**2:
            return 2
        if (x - 80)**2 / 1.4 + (y - 104)**2 < 30**2 and y > 96:
            return 1
        if abs(x - 84) < 14 and 34 < y < 96:
            return 3
        return 5 if abs(y - 96) < 1 and 18 < x < 112 else 6

    picture("picture_shapes", (128, 160), shapes)

    def leaf_print(x, y):
        for k in range(9):
            cx, cy = 64 + (18 if k % 2 else -18) * (1 - k / 12), 132 - 13 * k
            a = (x - cx) * 0.8 + (y - cy) * (0.6 if k % 2 else -0.6)
            b = -(x - cx) * (0.6 if k % 2 else -0.6) + (y - cy) * 0.8
            if (a / 20)**2 + (b / 7.5)**2 < 1:
                return 4 if k % 3 else 2
        return 2 if abs(x - 64) < 1.5 and 24 < y < 146 else 0

    picture("picture_leaf", (128, 160), leaf_print)
    write_png("shade", 2, 64, lambda x, y: y,
              ramp([(190, 130, 78), (236, 184, 122), (255, 216, 160), (244, 190, 126), (206, 146, 88)], 64))

    dice = random.Random(77)
    model = Model()
    model.material("walnut", (0.9, 0.9, 0.9), 0.0, 0.4, texture="walnut.png")
    model.material("oak", (0.25, 0.14, 0.07), 0.0, 0.45)
    model.material("sofa", (0.10, 0.17, 0.19), 0.0, 0.9)
    model.material("rust", (0.46, 0.13, 0.05), 0.0, 0.9)
    model.material("cream", (0.68, 0.6, 0.47), 0.0, 0.9)
    model.material("ochre", (0.55, 0.32, 0.07), 0.0, 0.9)
    model.material("white", (0.78, 0.76, 0.72), 0.0, 0.5)
    model.material("curtain", (0.72, 0.66, 0.56), 0.0, 0.95)
    model.material("rug", (1, 1, 1), 0.0, 1.0, texture="rug.png")
    model.material("brass", (0.8, 0.58, 0.28), 1.0, 0.25)
    model.material("black", (0.02, 0.02, 0.02), 0.0, 0.4)
    model.material("clay", (0.5, 0.22, 0.13), 0.0, 0.7)
    model.material("leaf", (0.06, 0.17, 0.04), 0.0, 0.35)
    model.material("stem", (0.16, 0.12, 0.06), 0.0, 0.7)
    model.material("orange", (0.8, 0.3, 0.03), 0.0, 0.4)
    model.material("glaze", (0.12, 0.24, 0.27), 0.0, 0.12)
    model.material("shade", (0.7, 0.6, 0.45),
                   0.0,
                   0.9,
                   emission=(1, 0.72, 0.4),
                   strength=1.0,
                   glow="shade.png")
    model.material("bulb", (0, 0, 0), 0.0, 1.0, emission=(1, 0.66, 0.34), strength=60.0)
    for file in ("sun", "shapes", "leaf"):
        model.material(f"picture {file}", (1, 1, 1), 0.0, 0.6, texture=f"picture_{file}.png")

    # Sofa at the rear wall.
    def put(material, mesh, x, y, z):
        model.add(material, mesh.move(x, y, z))

    sx, sz = -0.55, -1.9
    put("sofa", rounded_box(2.1, 0.22, 0.86, 0.05, 2), sx, 0.26, sz)
    put("sofa", rounded_box(2.1, 0.5, 0.2, 0.07, 3), sx, 0.56, sz - 0.34)
    for side in (-1, 1):
        put("sofa", rounded_box(0.17, 0.42, 0.88, 0.07, 3), sx + side * 1.0, 0.42, sz)
        put("sofa", rounded_box(0.9, 0.15, 0.68, 0.055, 2, puff=0.035), sx + side * 0.455, 0.435, sz + 0.09)
        put("sofa",
            rounded_box(0.88, 0.18, 0.4, 0.06, 2, puff=0.05).turn("x", 76), sx + side * 0.455, 0.7, sz - 0.17)
        for z in (-0.34, 0.34):
            put("oak", lathe([(0.018, 0), (0.03, 0.16)], 12), sx + side * 0.93, 0, sz + z)
    for material, x, lean, yaw, size in (("rust", -0.72, 66, 14, 0.42), ("cream", 0.66, 66, -12, 0.44),
                                         ("ochre", 0.36, 60, -22, 0.36)):
        put(material,
            rounded_box(size, 0.07, size, 0.03, 2, puff=0.055).turn("x", lean).turn("y", yaw), sx + x, 0.66,
            sz + (0.07 if size > 0.4 else 0.2))
    # Throw over an arm.
    put(
        "cream",
        surface(
            lambda u, v: (0.105 * cos(pi * min(1, max(0, (v - 0.3) / 0.4))) * 1.0 +
                          (0.006 * sin(40 * u)), 0.02 * sin(pi * v) +
                          (0.1 * sin(pi * min(1, max(0, (v - 0.3) / 0.4)))
                           if 0.3 < v < 0.7 else -(0.3 - v) * 0.9
                           if v <= 0.3 else -(v - 0.7) * 0.9), lerp(-0.2, 0.2, u) + 0.012 * sin(9 * v)), 12,
            24), sx + 1.0, 0.56, sz + 0.14)

    # Rug, coffee table and what stands on it.
    carpet = rounded_box(2.5, 0.018, 1.66, 0.008, 1)
    carpet.uvs = [(p[0] / 2.5 + 0.5, p[2] / 1.66 + 0.5) for p in carpet.positions]
    put("rug", carpet, -0.45, 0.01, -0.62)
    tx, tz = -0.5, -0.68
    top = lathe(bevel([(0, 0.385), (0.43, 0.385), (0.47, 0.4), (0.47, 0.42), (0, 0.42)], 0.008), 56)
    top.uvs = [(p[0] * 1.2 + 0.5, p[2] * 1.2) for p in top.positions]
    put("walnut", top, tx, 0, tz)
    for k in range(3):
        angle = tau * (k / 3 + 0.08)
        leg = [(tx + r * cos(angle), y, tz + r * sin(angle)) for r, y in ((0.26, 0.39), (0.39, 0.015))]
        model.add("oak", tube(leg, lambda t: 0.026 - 0.012 * t, 12))
    dish = smooth([(0.07, 0.0), (0.13, 0.02), (0.17, 0.07)], 4) + smooth([(0.162, 0.072), (0.122, 0.03),
                                                                          (0.0, 0.014)], 4)
    put("glaze", lathe([(0, 0)] + dish, 32), tx - 0.1, 0.42, tz - 0.08)
    for x, y, z in ((-0.05, 0.06, 0.0), (0.05, 0.06, 0.04), (0.0, 0.065, -0.06), (0.005, 0.125, 0.0)):
        put("orange", ball(0.042, 16), tx - 0.1 + x, 0.42 + y, tz - 0.08 + z)

    for level, (material, size) in enumerate((("rust", 0.2), ("white", 0.18))):
        put(material,
            rounded_box(size, 0.028, size * 1.35, 0.004, 1).turn("y", 24 + 14 * level), tx + 0.19,
            0.435 + 0.029 * level, tz + 0.13)
    mug = bevel([(0, 0), (0.036, 0), (0.04, 0.085)], 0.008) + [(0.036, 0.086), (0.034, 0.01), (0, 0.01)]
    put("white", lathe(mug, 24), tx + 0.2, 0.4785, tz + 0.12)

    # Floor lamp.
    lx, lz = 0.86, -1.98
    put("brass", lathe(bevel([(0, 0), (0.15, 0), (0.15, 0.02), (0.012, 0.035), (0.012, 0.08)], 0.008), 32),
        lx, 0, lz)
    model.add("brass", tube([(lx, 0.03, lz), (lx, 1.45, lz)], 0.011, 12))
    put("shade", lathe([(0.22, 1.36), (0.15, 1.68)], 40), lx, 0, lz)
    put("bulb", ball(0.042, 14), lx, 1.52, lz)

    # Shelf with books.
    bx, bz, wide, deep = 2.0, -2.14, 1.25, 0.32
    for side in (-1, 1):
        put("oak", rounded_box(0.035, 2.15, deep, 0.006, 1), bx + side * wide / 2, 1.075, bz)
    put("oak", rounded_box(wide, 2.1, 0.012, 0.003, 1), bx, 1.07, bz - deep / 2 + 0.008)
    colors = ["rust", "sofa", "cream", "ochre", "white", "glaze", "clay", "black"]
    for level in range(6):
        y = 0.08 + 0.41 * level
        put("oak", rounded_box(wide - 0.03, 0.03, deep - 0.01, 0.005, 1), bx, y, bz)
        if level == 5:
            break
        x = -wide / 2 + 0.035
        while x < wide / 2 - 0.08:
            if level in (1, 3) and -0.1 < x < 0.1:
                x += 0.36
                continue
            width, height = dice.uniform(0.022, 0.055), dice.uniform(0.21, 0.33)
            volume = rounded_box(width - 0.002, height, dice.uniform(0.17, 0.22), 0.005, 1)
            put(dice.choice(colors), volume, bx + x + width / 2, y + 0.015 + height / 2, bz + 0.03)
            x += width
            if dice.random() < 0.06:
                x += 0.1
    vase = smooth([(0.05, 0), (0.085, 0.08), (0.07, 0.17), (0.03, 0.22), (0.04, 0.26)], 5)
    put("clay", lathe([(0, 0)] + vase + [(0.033, 0.26), (0.022, 0.22), (0, 0.1)], 28), bx + 0.08, 0.505,
        bz + 0.04)
    put("brass", ball(0.09, 22), bx + 0.1, 1.325 + 0.09, bz + 0.04)

    # Plant: leaves on stems that lean outwards.
    px, pz = -2.45, -1.85
    pot = bevel([(0, 0), (0.15, 0), (0.19, 0.34), (0.2, 0.36)], 0.02) + [(0.185, 0.365), (0.175, 0.3),
                                                                         (0, 0.3)]
    put("white", lathe(pot, 36), px, 0, pz)
    put("stem", disc(0.176, 24), px, 0.305, pz)

    def blade(length, width, bend):

        def at(u, v):
            w = width * sin(pi * min(1.0, v**0.75))**0.8 * (u - 0.5)
            a = bend * v
            return (w, length * sin(a) / bend + 0.25 * abs(w), length * (1 - cos(a)) / bend)

        front = surface(at, 4, 9)
        return front + front.map(lambda p: sub(p, (0, 0, 0.0012))).flip() if front.normals[20][2] > 0 else \
            front + front.map(lambda p: add(p, (0, 0, 0.0012))).flip()

    for k in range(32):
        yaw, lean = k * 137.5, 6 + 34 * ((k * 0.618) % 1)
        height = 0.35 + 0.75 * (1 - (k * 0.618) % 1) * dice.uniform(0.8, 1.1)
        tip = (0, height * cos(math.radians(lean)), height * sin(math.radians(lean)))
        stem = Mesh() + tube(smooth([(0, 0, 0), (0, tip[1] * 0.6, tip[2] * 0.35), tip], 4), 0.006, 5)
        leaf = blade(dice.uniform(0.3, 0.44), dice.uniform(0.19, 0.26), 1.2).turn("x", lean + 12).move(*tip)
        for material, mesh in (("stem", stem), ("leaf", leaf)):
            put(material, mesh.turn("y", yaw), px, 0.3, pz)

    # Pictures above the sofa.
    for name, x, width, height in (("leaf", -1.25, 0.44, 0.56), ("sun", -0.55, 0.52, 0.66), ("shapes", 0.12,
                                                                                             0.44, 0.56)):
        for dx, dy, w, h in ((0, 1, width + 0.05, 0.025), (0, -1, width + 0.05, 0.025), (1, 0, 0.025, height),
                             (-1, 0, 0.025, height)):
            put("oak", rounded_box(w, h, 0.03, 0.004, 1), x + dx * (width / 2 + 0.012),
                1.52 + dy * (height / 2 + 0.012), -2.283)
        put(f"picture {name}", panel(width, height), x, 1.52, -2.288)

    # Windows in the wall at x = -3: frames, sills and curtains.
    for z0, z1 in ((-1.35, -0.25), (0.35, 1.45)):
        middle = (z0 + z1) / 2
        for z in (z0 + 0.03, z1 - 0.03):
            put("white", rounded_box(0.07, 1.9, 0.06, 0.008, 1), -3.04, 1.4, z)
        put("white", rounded_box(0.05, 1.9, 0.04, 0.008, 1), -3.04, 1.4, middle)
        for y in (0.48, 1.75, 2.32):
            put("white", rounded_box(0.07, 0.06 if y != 1.75 else 0.04, z1 - z0, 0.008, 1), -3.04, y, middle)
        put("white", rounded_box(0.2, 0.035, z1 - z0 + 0.16, 0.01, 1), -3.05, 0.44, middle)
        model.add("brass", tube([(-2.9, 2.5, z0 - 0.42), (-2.9, 2.5, z1 + 0.42)], 0.012, 10))
        for edge, way in ((z0 - 0.3, 1), (z1 + 0.3, -1)):

            def folds(u, v, edge=edge, way=way):
                width = 0.44 - 0.1 * sin(pi * min(1, v * 1.15))**2
                return (-2.9 + 0.035 * sin(tau * 5 * u) * (0.5 + 0.5 * v), lerp(2.49, 0.04, v),
                        edge + way * (width * u + 0.012 * cos(tau * 5 * u)))

            sheet = surface(folds, 44, 5)
            model.add("curtain", sheet)

    # Armchair at the left, turned to the sofa.
    chair = []
    chair.append(("rust", rounded_box(0.58, 0.12, 0.56, 0.05, 2, puff=0.03).turn("x", -5).move(0, 0.42,
                                                                                               0.02)))
    chair.append(("rust", rounded_box(0.56, 0.11, 0.5, 0.05, 2, puff=0.03).turn("x", 74).move(0, 0.7, -0.26)))
    for side in (-1, 1):
        x = side * 0.33
        chair.append(("walnut",
                      tube(smooth([(x, 0.0, 0.3), (x, 0.3, 0.28), (x, 0.57, 0.27)], 4),
                           lambda t: 0.016 + 0.008 * t, 10)))
        chair.append(("walnut",
                      tube(smooth([(x, 0.0, -0.42), (x, 0.35, -0.3), (x, 0.62, -0.33), (x, 0.95, -0.45)], 4),
                           lambda t: 0.016 + 0.006 * sin(pi * t), 10)))
        chair.append(("walnut", rounded_box(0.055, 0.026, 0.68, 0.012, 2).turn("x", -3).move(x, 0.595,
                                                                                             -0.02)))
        chair.append(("walnut", tube([(x, 0.34, 0.28), (x, 0.3, -0.33)], 0.016, 10)))
    for y, z in ((0.33, 0.27), (0.31, -0.31), (0.9, -0.435), (0.52, -0.31)):
        chair.append(("walnut", tube([(-0.33, y, z), (0.33, y, z)], 0.016, 10)))
    for material, mesh in chair:
        model.add(material, mesh.turn("y", 122).move(-1.72, 0, 0.02))
    model.write("furniture")


if __name__ == "__main__":
    still_life()
    camera()
    lanterns()
    interior()
