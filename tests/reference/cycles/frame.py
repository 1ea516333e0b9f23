#!/usr/bin/env python3
"""Copies models to the current folder, as .gltf with a camera that shows all of each: frame.py PROGRAM MODEL...

A camera of the model's own stays. Primitives without a material get the specification's default one explicitly, because
Blender draws them with a gray diffuse one of its own."""

import base64
import json
import math
import os
import re
import struct
import subprocess
import sys

DIRECTION = (0.5, 0.35, 0.79)  # from the model towards the camera


def load(path):
    """Returns the JSON of a model, with its buffers and images inside."""
    with open(path, "rb") as file:
        data = file.read()
    inside = None
    if data[:4] == b"glTF":
        length = struct.unpack_from("<I", data, 12)[0]
        inside = data[28 + length :]
        data = data[20 : 20 + length]
    model = json.loads(data)
    for part in model.get("buffers", []) + model.get("images", []):
        content = inside if "uri" not in part and "bufferView" not in part else None
        if not part.get("uri", "data:").startswith("data:"):
            with open(os.path.join(os.path.dirname(path), part["uri"]), "rb") as file:
                content = file.read()
        if content is not None:
            kind = part.get("mimeType") or ("image/png" if content[:4] == b"\x89PNG" else "application/octet-stream")
            kind = "image/jpeg" if content[:2] == b"\xff\xd8" else kind
            content = base64.b64encode(content[: part.get("byteLength", len(content))]).decode()
            part["uri"] = f"data:{kind};base64,{content}"
    return model


def extents(program, path):
    report = subprocess.run([program, "check", path], capture_output=True, text=True).stdout
    low, high = re.search(r"all of it *(\[.*\]) to (\[.*\])", report).groups()
    return json.loads(low), json.loads(high)


program = sys.argv[1]
for path in sys.argv[2:]:
    model = load(path)
    if not model.get("cameras"):
        low, high = extents(program, path)
        centre = [(a + b) / 2 for a, b in zip(low, high)]
        radius = math.dist(low, high) / 2
        away = 1.05 * radius / math.sin(math.radians(20))
        length = math.hypot(*DIRECTION)
        z = [x / length for x in DIRECTION]
        x = [z[2] / math.hypot(z[0], z[2]), 0, -z[0] / math.hypot(z[0], z[2])]
        y = [z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]]
        place = [c + away * d for c, d in zip(centre, z)]
        lens = {"yfov": math.radians(40), "aspectRatio": 1, "znear": 0.01 * radius, "zfar": 10 * away}
        model["cameras"] = [{"type": "perspective", "perspective": lens}]
        node = {"camera": 0, "matrix": [*x, 0, *y, 0, *z, 0, *place, 1]}
        model.setdefault("nodes", []).append(node)
        model["scenes"][model.get("scene", 0)]["nodes"].append(len(model["nodes"]) - 1)
    parts = [part for mesh in model.get("meshes", []) for part in mesh["primitives"] if "material" not in part]
    if parts:
        model.setdefault("materials", []).append({"pbrMetallicRoughness": {}})
        for part in parts:
            part["material"] = len(model["materials"]) - 1
    with open(os.path.splitext(os.path.basename(path))[0] + ".gltf", "w") as file:
        json.dump(model, file)
