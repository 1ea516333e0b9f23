#!/usr/bin/env python3
"""Renders glTF models with Blender's Cycles: render_models.py SAMPLES MODEL...

Needs `pip install bpy==4.5.*` (Python 3.11). Writes NAME.uniform.pfm, in a world of radiance 0.1, and
NAME.panorama.pfm, in that of panorama.pfm. A name that ends in _at_1.5s states the time of the animation. A model
without a camera is seen from (0, 0, 4) along -z with 40 degrees. Box filter, no clamp, no denoiser."""

import math
import os
import re
import sys

import bpy
import addon_utils  # in a folder that bpy adds to the path
import numpy

SIZE = 64
OPTIONS = {
    "device": "CPU",
    "use_adaptive_sampling": False,
    "use_denoising": False,
    "pixel_filter_type": "BOX",
    "filter_width": 1.0,
    "sample_clamp_direct": 0,
    "sample_clamp_indirect": 0,
    "max_bounces": 16,
    "diffuse_bounces": 16,
    "glossy_bounces": 16,
    "transmission_bounces": 16,
    "transparent_max_bounces": 32,
    "blur_glossy": 0,
}


def read(path):
    """Returns the pixels of an image that Blender reads, the lowest row first."""
    image = bpy.data.images.load(path, check_existing=False)
    pixels = numpy.array(image.pixels[:], "<f4").reshape(image.size[1], image.size[0], 4)[:, :, :3]
    bpy.data.images.remove(image)
    return pixels


def pfm(path):
    """Returns the pixels of a PFM file, the lowest row first."""
    with open(path, "rb") as file:
        file.readline()
        width, height = map(int, file.readline().split())
        file.readline()
        return numpy.frombuffer(file.read(), "<f4").reshape(height, width, 3)


def environment(scene, pixels):
    """Makes the world's colour an equirectangular image whose middle is along Blender's y, glTF's -z."""
    nodes, links = scene.world.node_tree.nodes, scene.world.node_tree.links
    image = bpy.data.images.new("panorama", pixels.shape[1], pixels.shape[0], float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    image.pixels[:] = numpy.dstack([pixels, numpy.ones(pixels.shape[:2])]).astype("f4").ravel()
    texture, mapping = nodes.new("ShaderNodeTexEnvironment"), nodes.new("ShaderNodeMapping")
    texture.image = image
    mapping.inputs["Rotation"].default_value[2] = -math.pi / 2
    links.new(nodes.new("ShaderNodeTexCoord").outputs["Generated"], mapping.inputs["Vector"])
    links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    links.new(texture.outputs["Color"], nodes["Background"].inputs["Color"])


def camera(scene):
    """Uses the model's camera, or the usual one."""
    own = [each for each in scene.objects if each.type == "CAMERA"]
    if own:
        scene.camera = own[0]
        return
    lens = bpy.data.cameras.new("camera")
    lens.angle = math.radians(40)
    scene.camera = bpy.data.objects.new("camera", lens)
    scene.collection.objects.link(scene.camera)
    scene.camera.location = (0, -4, 0)  # Blender's z is glTF's y
    scene.camera.rotation_euler = (math.pi / 2, 0, 0)


def render(source, name, samples):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    addon_utils.enable("cycles")
    # Lights keep their numbers: a candela is a watt per steradian, a lux a watt per square metre.
    bpy.ops.import_scene.gltf(filepath=os.path.abspath(source), export_import_convert_lighting_mode="COMPAT")
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    for option, value in {**OPTIONS, "samples": samples}.items():
        setattr(scene.cycles, option, value)
    time = re.search(r"_at_([0-9.]+)s", source)
    if time:
        frame = float(time[1]) * scene.render.fps
        scene.frame_set(int(frame), subframe=frame % 1)
    camera(scene)
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.view_settings.view_transform = "Raw"
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGB"
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (0.1, 0.1, 0.1, 1)
    for light in ("uniform", "panorama"):
        if light == "panorama":
            environment(scene, pfm("panorama.pfm"))
        scene.render.filepath = os.path.abspath(f"{name}.{light}.exr")
        bpy.ops.render.render(write_still=True)
        with open(f"{name}.{light}.pfm", "wb") as file:
            file.write(f"PF\n{SIZE} {SIZE}\n-1.0\n".encode() + read(scene.render.filepath).tobytes())
        os.remove(scene.render.filepath)


for model in sys.argv[2:]:
    render(model, re.sub(r"\.gl(b|tf)$", "", model), int(sys.argv[1]))
