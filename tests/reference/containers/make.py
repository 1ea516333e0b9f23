#!/usr/bin/env python3
"""Writes one model in each container that glTF has, by the codecs' own encoders, to the current
folder: a ball with normals, texture coordinates and a texture.

Needs `pip install DracoPy==2.2.0 meshoptimizer==0.2.30a0 alktx2==0.1.7 pillow`; its output is
committed in host/scene/assets/containers, which the readers' tests compare with `plain.glb`."""

import io
import json
import math
import struct

import alktx2
import DracoPy
import meshoptimizer
import numpy as np
from PIL import Image

ROWS = 10


def ball():
    """Returns positions, normals, texture coordinates and triangles."""
    points, uvs, triangles = [], [], []
    for j in range(ROWS + 1):
        for i in range(2 * ROWS + 1):
            polar, around = math.pi * j / ROWS, math.pi * i / ROWS
            sine = math.sin(polar)
            points.append([sine * math.cos(around), math.cos(polar), -sine * math.sin(around)])
            uvs.append([i / (2 * ROWS), j / ROWS])
    for j in range(ROWS):
        for i in range(2 * ROWS):
            a = j * (2 * ROWS + 1) + i
            b, c, d = a + 2 * ROWS + 1, a + 2 * ROWS + 2, a + 1
            triangles += ([[a, b, c]] if j < ROWS - 1 else []) + ([[a, c, d]] if j > 0 else [])
    points, uvs = np.array(points, np.float32), np.array(uvs, np.float32)
    return points, points.copy(), uvs, np.array(triangles, np.uint32)


def picture():
    """Returns a smooth picture, which lossy codecs keep well."""
    x, y = np.meshgrid(np.arange(16), np.arange(16))
    channels = [60 + 10 * x, 40 + 12 * y, 200 - 6 * (x + y), 255 - 5 * x]
    return np.stack(channels, axis=-1).astype(np.uint8)


def encoded(kind):
    image, file = Image.fromarray(picture(), "RGBA"), io.BytesIO()
    image.save(file, "PNG")
    if kind == "webp":
        file = io.BytesIO()
        image.save(file, "WEBP", lossless=True, exact=True)
    if kind in ("etc1s", "uastc"):
        options = {"zstd_supercompression_level": 6} if kind == "uastc" else {}
        return alktx2.encode_bytes_to_ktx2(
            file.getvalue(), mime="png", codec=kind, quality=255, effort=2, srgb=True, **options
        )
    return file.getvalue()


class File:
    def __init__(self):
        self.data, self.views, self.accessors, self.used = b"", [], [], set()

    def view(self, data, **more):
        self.data += b"\0" * (-len(self.data) % 8)
        self.views.append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data), **more})
        self.data += data
        return len(self.views) - 1

    def accessor(self, view, rows, component, kind):
        accessor = {"componentType": component, "count": len(rows), "type": kind}
        if view is not None:
            accessor["bufferView"] = view
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def compressed(self, data, rows, stride, mode, name):
        """Adds a view whose bytes are in a buffer that has none."""
        where = {"buffer": 0, "byteOffset": len(self.data) + (-len(self.data) % 8), "byteLength": len(data)}
        self.view(data)
        self.views.pop()
        size = stride * rows
        offset = sum(view["byteLength"] for view in self.views if view["buffer"] == 1)
        extension = {**where, "byteStride": stride, "count": rows, "mode": mode}
        self.views.append({"buffer": 1, "byteOffset": offset, "byteLength": size, "extensions": {name: extension}})
        self.used.add(name)
        return len(self.views) - 1

    def write(self, path, primitive, image_kind):
        image = {"bufferView": self.view(encoded(image_kind))}
        mime = {"png": "png", "webp": "webp"}.get(image_kind, "ktx2")
        image["mimeType"] = f"image/{mime}"
        texture = {"source": 0}
        if image_kind != "png":
            name = "EXT_texture_webp" if image_kind == "webp" else "KHR_texture_basisu"
            texture = {"extensions": {name: {"source": 0}}}
            self.used.add(name)
        buffers = [{"byteLength": len(self.data)}]
        fallback = sum(view["byteLength"] for view in self.views if view["buffer"] == 1)
        if fallback:
            name = next(name for name in self.used if "meshopt" in name)
            buffers.append({"byteLength": fallback, "extensions": {name: {"fallback": True}}})
        root = {
            "asset": {"version": "2.0"},
            "extensionsUsed": sorted(self.used),
            "extensionsRequired": sorted(self.used),
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{**primitive, "material": 0}]}],
            "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0}}],
            "textures": [texture],
            "images": [image],
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": buffers,
        }
        root = {key: value for key, value in root.items() if value != []}
        text = json.dumps(root, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        data = self.data + b"\0" * (-len(self.data) % 4)
        chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
        with open(path, "wb") as file:
            file.write(struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks)


def plain(path, image_kind):
    file = File()
    points, normals, uvs, triangles = ball()
    accessor = lambda rows, kind: file.accessor(file.view(rows.tobytes()), rows, 5126, kind)
    attributes = {
        "POSITION": accessor(points, "VEC3"),
        "NORMAL": accessor(normals, "VEC3"),
        "TEXCOORD_0": accessor(uvs, "VEC2"),
    }
    indices = triangles.reshape(-1)
    indices = file.accessor(file.view(indices.tobytes()), indices, 5125, "SCALAR")
    file.write(path, {"attributes": attributes, "indices": indices}, image_kind)


def draco(path):
    file = File()
    points, normals, uvs, triangles = ball()
    data = DracoPy.encode(points, triangles, quantization_bits=14, compression_level=7, normals=normals.astype(float), tex_coord=uvs.astype(float))
    decoded = DracoPy.decode(data)
    ids = {"GENERIC": None}
    for attribute in decoded.attributes:
        ids[str(attribute["attribute_type"])] = attribute["unique_id"]
    print(ids)
    names = {"POSITION": ids["0"], "NORMAL": ids["1"], "TEXCOORD_0": ids["3"]}
    count = decoded.points
    attributes = {
        "POSITION": file.accessor(None, count, 5126, "VEC3"),
        "NORMAL": file.accessor(None, count, 5126, "VEC3"),
        "TEXCOORD_0": file.accessor(None, count, 5126, "VEC2"),
    }
    indices = file.accessor(None, triangles.reshape(-1), 5125, "SCALAR")
    extension = {"bufferView": file.view(data), "attributes": names}
    file.used.add("KHR_draco_mesh_compression")
    primitive = {
        "attributes": attributes,
        "indices": indices,
        "extensions": {"KHR_draco_mesh_compression": extension},
    }
    file.write(path, primitive, "png")


def meshopt(path, name, version):
    meshoptimizer.encode_vertex_version(version)
    meshoptimizer.encode_index_version(1)
    file = File()
    points, normals, uvs, triangles = ball()

    def vertices(rows, kind):
        stride = rows.shape[1] * 4
        data = bytes(meshoptimizer.encode_vertex_buffer(np.ascontiguousarray(rows), len(rows), stride))
        view = file.compressed(data, len(rows), stride, "ATTRIBUTES", name)
        return file.accessor(view, rows, 5126, kind)

    attributes = {
        "POSITION": vertices(points, "VEC3"),
        "NORMAL": vertices(normals, "VEC3"),
        "TEXCOORD_0": vertices(uvs, "VEC2"),
    }
    indices = triangles.reshape(-1)
    data = bytes(meshoptimizer.encode_index_buffer(indices, len(indices), len(points)))
    view = file.compressed(data, len(indices), 4, "TRIANGLES", name)
    indices = file.accessor(view, indices, 5125, "SCALAR")
    file.write(path, {"attributes": attributes, "indices": indices}, "png")


plain("plain.glb", "png")
for kind in ("webp", "etc1s", "uastc"):
    plain(f"{kind}.glb", kind)
draco("draco.glb")
meshopt("ext_meshopt.glb", "EXT_meshopt_compression", 0)
meshopt("khr_meshopt.glb", "KHR_meshopt_compression", 1)
