#!/usr/bin/env python3
"""Renders glTF models with Blender's Cycles to NAME.cycles.exr: render_models.py SAMPLES MODEL...

Needs `pip install bpy==4.5.*` (Python 3.11). A name that ends in _at_1.5s states the
time of the animation. The camera stands at (0, 0, 4) and looks along -z with 40 degrees; the world has radiance 0.1; a box filter, no clamp, no denoiser."""

import math
import re
import sys

import bpy
import addon_utils  # in a folder that bpy adds to the path


def render(source, target, samples):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    addon_utils.enable("cycles")
    bpy.ops.import_scene.gltf(filepath=source)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    options = {
        "device": "CPU",
        "samples": samples,
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
    for name, value in options.items():
        setattr(scene.cycles, name, value)
    time = re.search(r"_at_([0-9.]+)s", source)
    if time:
        frame = float(time[1]) * scene.render.fps
        scene.frame_set(int(frame), subframe=frame % 1)
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (0.1, 0.1, 0.1, 1)
    camera = bpy.data.cameras.new("camera")
    camera.angle = math.radians(40)
    scene.camera = bpy.data.objects.new("camera", camera)
    scene.collection.objects.link(scene.camera)
    scene.camera.location = (0, -4, 0)  # Blender's z is glTF's y
    scene.camera.rotation_euler = (math.pi / 2, 0, 0)
    scene.render.resolution_x = scene.render.resolution_y = 96
    scene.view_settings.view_transform = "Raw"
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGB"
    scene.render.filepath = target
    bpy.ops.render.render(write_still=True)


for model in sys.argv[2:]:
    render(model, model.removesuffix(".glb") + ".cycles.exr", int(sys.argv[1]))
