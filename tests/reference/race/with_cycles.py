"""Renders a scene by Blender's Cycles (package bpy 4.5, Python 3.11) with as many samples as take the given time: see race.py.

The time is that of a render, less that of one with a single sample, which builds the same tree of the scene and writes
the same file. Scenes keep their coordinates, with y up.
"""
import math
import os
import sys
import tempfile
import time

import bpy
import addon_utils  # in a folder that bpy adds to the path
import numpy as np
from mathutils import Matrix, Vector

from worker import arguments, run

sys.path[1:1] = [os.path.join(os.path.dirname(os.path.abspath(__file__)), "../mitsuba")]
import ron

SETTINGS = {  # light tree, shadow caustics
    "light tree": (True, False),
    "no light tree": (False, False),
    "light tree, shadow caustics": (True, True),
}


def nodes_of(material):
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    return tree, tree.nodes.new("ShaderNodeOutputMaterial")


def colour(rgb):
    return (*rgb, 1)


def mix(tree, a, b, factor):
    """Returns the output that is `a` where `factor` is 0 and `b` where it is 1."""
    node = tree.nodes.new("ShaderNodeMixShader")
    tree.links.new(factor, node.inputs[0])
    tree.links.new(a, node.inputs[1])
    tree.links.new(b, node.inputs[2])
    return node.outputs[0]


def shader(tree, kind, **inputs):
    node = tree.nodes.new(kind)
    for name, value in inputs.items():
        node.inputs[name].default_value = value
    return node


def material(name, description, media):
    kind, f = description
    made = bpy.data.materials.new(name)
    tree, output = nodes_of(made)
    surface = output.inputs["Surface"]
    if kind == "Lambertian":
        tree.links.new(shader(tree, "ShaderNodeBsdfDiffuse", Color=colour(f["albedo"])).outputs[0], surface)
    elif kind == "Metal" and f.get("fuzz", 0) == 0:
        mirror = shader(tree, "ShaderNodeBsdfAnisotropic", Color=colour(f["albedo"]), Roughness=0)
        tree.links.new(mirror.outputs[0], surface)
    elif kind == "Dielectric":
        glass = shader(tree, "ShaderNodeBsdfGlass", Color=colour((1, 1, 1)), Roughness=0, IOR=f["ior"])
        tree.links.new(glass.outputs[0], surface)
    elif kind == "Emissive":
        largest = max(f["radiance"])
        light = shader(tree, "ShaderNodeEmission", Color=colour([x / largest for x in f["radiance"]]), Strength=largest)
        black = shader(tree, "ShaderNodeBsdfDiffuse", Color=colour((0, 0, 0)))
        facing = tree.nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"]
        tree.links.new(mix(tree, light.outputs[0], black.outputs[0], facing), surface)
        made.cycles.emission_sampling = "FRONT"
    elif kind == "Interface":
        medium = media[f["medium"]]
        extinction, albedo = np.array(medium["extinction"]), np.array(medium.get("albedo", (0, 0, 0)))
        parts = []
        for type_, coefficient in (("Scatter", extinction * albedo), ("Absorption", extinction * (1 - albedo))):
            if coefficient.any():
                density = coefficient.max()
                share = coefficient / density
                share = share if type_ == "Scatter" else 1 - share
                parts.append(shader(tree, f"ShaderNodeVolume{type_}", Color=colour(share), Density=density).outputs[0])
        if len(parts) == 2:
            add = tree.nodes.new("ShaderNodeAddShader")
            tree.links.new(parts[0], add.inputs[0])
            tree.links.new(parts[1], add.inputs[1])
            parts = [add.outputs[0]]
        tree.links.new(parts[0], output.inputs["Volume"])
    else:
        raise ValueError(f"no twin for {kind}")
    return made


def mesh(name, vertices, faces, smooth=False):
    data = bpy.data.meshes.new(name)
    data.from_pydata([tuple(map(float, v)) for v in vertices], [], faces)
    if smooth:
        data.polygons.foreach_set("use_smooth", [True] * len(data.polygons))
    data.update()
    return data


def sphere_mesh(name, rings=128):
    """Returns a sphere of radius 1."""
    vertices, faces = [(0, 1, 0)], []
    for i in range(1, rings):
        theta = math.pi * i / rings
        for j in range(2 * rings):
            phi = math.pi * j / rings
            vertices.append((math.sin(theta) * math.cos(phi), math.cos(theta), -math.sin(theta) * math.sin(phi)))
    last = len(vertices)
    vertices.append((0, -1, 0))
    at = lambda i, j: 1 + (i - 1) * 2 * rings + j % (2 * rings)
    for j in range(2 * rings):
        faces.append((0, at(1, j), at(1, j + 1)))
        faces.append((last, at(rings - 1, j + 1), at(rings - 1, j)))
        faces += [(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)) for i in range(1, rings - 1)]
    return mesh(name, vertices, faces, smooth=True)


def placement(steps):
    result = Matrix()
    for kind, values in steps:
        step = Matrix.Translation(values[0]) if kind == "Translate" else Matrix.Rotation(math.radians(values[0]), 4, "Y")
        result = step @ result
    return result


BOX_FACES = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]


def build(scene, shadow_caustics):
    """Makes the scene's objects, lights, camera and sky."""
    world = bpy.context.scene
    materials = {n: material(n, d, scene.get("media", {})) for n, d in scene["materials"].items()}
    ball = sphere_mesh("ball")
    add = world.collection.objects.link

    def place(data, matrix, own):
        made = bpy.data.objects.new("object", data)
        add(made)
        made.matrix_world = matrix
        # The material belongs to the object, because spheres share their mesh.
        if not data.materials:
            data.materials.append(None)
        made.material_slots[0].link = "OBJECT"
        made.material_slots[0].material = own
        return made

    def lamp(kind, name, rgb, energy, matrix):
        data = bpy.data.lights.new(name, kind)
        largest = max(rgb)
        data.color, data.energy = [x / largest for x in rgb], energy * largest
        data.cycles.is_caustics_light = shadow_caustics
        made = bpy.data.objects.new(name, data)
        add(made)
        made.matrix_world, made.visible_camera = matrix, True
        return data

    for kind, f in scene["objects"]:
        own, description = materials[f["material"]], scene["materials"][f["material"]]
        if kind == "Sphere" and description[0] == "Emissive":
            # A light with a radius is a sphere, which Cycles samples as one.
            area = 4 * math.pi * f["radius"] ** 2
            data = lamp("POINT", "bulb", description[1]["radiance"], math.pi * area, Matrix.Translation(f["center"]))
            data.shadow_soft_size, data.use_soft_falloff = f["radius"], False
            continue
        if kind == "Sphere":
            matrix = Matrix.Translation(f["center"]) @ Matrix.Scale(f["radius"], 4)
            made = place(ball, matrix, own)
        elif kind == "Quad" and description[0] == "Emissive" and shadow_caustics:
            corner, u, v = (Vector(f[k]) for k in ("corner", "u", "v"))
            z = -u.cross(v).normalized()  # an area light shines along -z
            matrix = Matrix((u.normalized(), -v.normalized(), z)).transposed().to_4x4()
            matrix.translation = corner + u / 2 + v / 2
            data = lamp("AREA", "panel", description[1]["radiance"], math.pi * u.length * v.length, matrix)
            data.shape, data.size, data.size_y = "RECTANGLE", u.length, v.length
            continue
        elif kind == "Quad":
            corner, u, v = (np.array(f[k]) for k in ("corner", "u", "v"))
            made = place(mesh("quad", [corner, corner + u, corner + u + v, corner + v], [(0, 1, 2, 3)]), Matrix(), own)
        elif kind == "Box":
            corners = [[f["max" if i >> axis & 1 else "min"][axis] for axis in range(3)] for i in range(8)]
            made = place(mesh("box", corners, BOX_FACES), placement(f.get("transform", [])), own)
        else:
            raise ValueError(kind)
        made.cycles.is_caustics_caster = shadow_caustics and description[0] == "Dielectric"
        made.cycles.is_caustics_receiver = shadow_caustics and description[0] == "Lambertian"
    for kind, f in scene.get("lights", []):
        if kind == "Point":
            data = lamp("POINT", "point", f["intensity"], 4 * math.pi, Matrix.Translation(f["position"]))
            data.shadow_soft_size = 0
        elif kind == "Directional":
            turn = Vector(f["direction"]).to_track_quat("-Z", "Y").to_matrix().to_4x4()
            lamp("SUN", "sun", f["irradiance"], 1, turn).angle = 0
        else:
            raise ValueError(kind)
    kind, f = scene.get("sky", ("Black", {}))
    world.world = bpy.data.worlds.new("world")
    world.world.use_nodes = True
    tree = world.world.node_tree
    background = tree.nodes["Background"]
    background.inputs[0].default_value = colour(f["radiance"] if kind == "Uniform" else (0, 0, 0))
    if kind == "Gradient":
        # From the bottom colour at y = -1 to the top one at y = 1.
        split = tree.nodes.new("ShaderNodeSeparateXYZ")
        tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"], split.inputs[0])
        share = tree.nodes.new("ShaderNodeMapRange")
        share.inputs["From Min"].default_value = -1
        tree.links.new(split.outputs["Y"], share.inputs["Value"])
        blend = tree.nodes.new("ShaderNodeMix")
        blend.data_type = "RGBA"
        blend.inputs["A"].default_value, blend.inputs["B"].default_value = colour(f["bottom"]), colour(f["top"])
        tree.links.new(share.outputs["Result"], blend.inputs["Factor"])
        tree.links.new(blend.outputs["Result"], background.inputs["Color"])
    elif kind not in ("Uniform", "Black"):
        raise ValueError(kind)


def camera(scene):
    world, f = bpy.context.scene, scene["camera"]
    data = bpy.data.cameras.new("camera")
    data.sensor_fit, data.clip_start, data.clip_end = "VERTICAL", 1e-3, 1e6
    data.angle = math.radians(f["vertical_fov"])
    made = bpy.data.objects.new("camera", data)
    world.collection.objects.link(made)
    eye, at = Vector(f["look_from"]), Vector(f["look_at"])
    z = (eye - at).normalized()
    x = Vector(f.get("up", (0, 1, 0))).cross(z).normalized()
    made.matrix_world = Matrix.Translation(eye) @ Matrix((x, z.cross(x), z)).transposed().to_4x4()
    if f.get("defocus_angle", 0) != 0:
        data.dof.use_dof, data.dof.focus_distance = True, f["focus_distance"]
        radius = f["focus_distance"] * math.tan(math.radians(f["defocus_angle"]) / 2)
        data.dof.aperture_fstop = data.lens / 1000 / (2 * radius)
    world.camera = made
    world.render.resolution_x, world.render.resolution_y = int(scene["image"]["width"]), int(scene["image"]["height"])


def options(depth, threads, light_tree):
    world = bpy.context.scene
    bounces = depth - 2  # a path of one segment has the lights that the camera sees, of two the direct light
    chosen = {
        "device": "CPU", "use_adaptive_sampling": False, "use_denoising": False, "use_light_tree": light_tree,
        "pixel_filter_type": "BOX", "filter_width": 1.0, "sample_clamp_direct": 0, "sample_clamp_indirect": 0,
        "max_bounces": bounces, "diffuse_bounces": bounces, "glossy_bounces": bounces, "transmission_bounces": bounces,
        "volume_bounces": bounces, "transparent_max_bounces": 32, "blur_glossy": 0,
    }
    for name, value in chosen.items():
        setattr(world.cycles, name, value)
    world.render.engine = "CYCLES"
    world.render.threads_mode, world.render.threads = "FIXED", threads
    world.view_settings.view_transform = "Raw"
    settings = world.render.image_settings
    settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGB"


def read(path):
    image = bpy.data.images.load(path, check_existing=False)
    pixels = np.array(image.pixels[:], np.float64).reshape(image.size[1], image.size[0], 4)[::-1, :, :3]
    bpy.data.images.remove(image)
    return pixels


args = arguments(SETTINGS)
light_tree, shadow_caustics = SETTINGS[args.setting]
with open(args.scene) as file:
    description = ron.parse(file.read())
bpy.ops.wm.read_factory_settings(use_empty=True)
addon_utils.enable("cycles")
build(description, shadow_caustics)
camera(description)
options(int(description["image"]["depth"]), args.threads, light_tree)


def timed(spp, seed, path):
    world = bpy.context.scene
    world.cycles.samples, world.cycles.seed, world.render.filepath = spp, seed, path
    start = time.perf_counter()
    bpy.ops.render.render(write_still=True)
    return time.perf_counter() - start


with tempfile.TemporaryDirectory() as folder:
    path = os.path.join(folder, "image.exr")
    timed(1, 0, path)
    start = min(timed(1, 0, path) for _ in range(3))

    def render(spp, seed):
        seconds = (timed(spp, seed, path) - start) * spp / max(spp - 1, 1)
        return read(path), spp, seconds

    run(args, render)
