"""Trisect: a path tracer whose kernels are written once and run on CPUs, through Vulkan and CUDA.

Radiance is linear Rec. 709, y is up, lengths are in scene units, images have their top row first.

>>> import trisect
>>> scene = trisect.Scene.hello_world()
>>> frame = trisect.Renderer(scene, "cpu").render(spp=16, width=64)
>>> frame.image.shape
(36, 64, 3)
"""

import os as _os

import numpy as _numpy  # noqa: F401  (the compiled part needs it)

if "DISPLAY" not in _os.environ and "WAYLAND_DISPLAY" not in _os.environ:
    # Mesa's layer that asks a display for its device would print an error for each Vulkan instance.
    _os.environ.setdefault("NODEVICE_SELECT", "1")

from . import errors, parts
from ._trisect import (
    Film,
    Frame,
    Progress,
    Renderer,
    Scene,
    __version__,
    compare,
    devices,
    evaluate,
    read_image,
)
from .errors import (
    BackendError,
    BusyError,
    CancelledError,
    CheckpointError,
    DenoiseError,
    FilmError,
    ForkError,
    ImageError,
    LabError,
    MetricsError,
    RenderInterrupted,
    SceneError,
    SceneWarning,
    SettingsError,
    TrisectError,
    UnavailableError,
)
from .parts import (
    Box,
    Camera,
    Conductor,
    Dielectric,
    Directional,
    Disc,
    Emissive,
    Gradient,
    Ground,
    Image,
    Interface,
    Ior,
    Lambertian,
    Medium,
    Mesh,
    Metal,
    MetallicRoughness,
    Model,
    Panorama,
    Plane,
    Point,
    Portal,
    Quad,
    RoughDielectric,
    Schlick,
    Sphere,
    Spheres,
    Spot,
    Studio,
    Sun,
    Texture,
    Uniform,
)

__all__ = [
    "__version__",
    "BackendError",
    "Box",
    "BusyError",
    "Camera",
    "CancelledError",
    "CheckpointError",
    "compare",
    "Conductor",
    "DenoiseError",
    "devices",
    "Dielectric",
    "Directional",
    "Disc",
    "Emissive",
    "errors",
    "evaluate",
    "Film",
    "FilmError",
    "ForkError",
    "Frame",
    "Gradient",
    "Ground",
    "Image",
    "ImageError",
    "Interface",
    "Ior",
    "LabError",
    "Lambertian",
    "Medium",
    "Mesh",
    "Metal",
    "MetallicRoughness",
    "MetricsError",
    "Model",
    "Panorama",
    "parts",
    "Plane",
    "Point",
    "Portal",
    "Progress",
    "Quad",
    "read_image",
    "Renderer",
    "RenderInterrupted",
    "RoughDielectric",
    "Scene",
    "SceneError",
    "SceneWarning",
    "Schlick",
    "SettingsError",
    "Sphere",
    "Spheres",
    "Spot",
    "Studio",
    "Sun",
    "Texture",
    "TrisectError",
    "UnavailableError",
    "Uniform",
]
