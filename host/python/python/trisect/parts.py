"""Parts of which scenes are built.

Fields have the names, units and ranges of the scene format (docs/reference/scene-format). Vectors
are three numbers, colours linear Rec. 709, angles degrees; y is up. Materials, textures and media
are named in the mappings of :class:`trisect.Scene`, and referred to by name. All materials but
:class:`Emissive` and :class:`Interface` may emit, be transparent and have a normal map.
"""

from __future__ import annotations

import typing as t
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

Vec3 = t.Union[t.Tuple[float, float, float], t.Sequence[float], npt.NDArray[t.Any]]
Transform = t.Union[t.Sequence[t.Sequence[float]], npt.NDArray[t.Any]]
Floats = npt.NDArray[np.float32]
Indices = npt.NDArray[np.uint32]
Pixels = t.Union[npt.NDArray[np.uint8], npt.NDArray[np.float32]]

def _word(default: str) -> t.Any:
    return field(default=default, metadata={"word": True})


@dataclass(frozen=True, eq=False)
class Camera:
    """Thin lens, or a pinhole with ``defocus_angle`` 0; ``height`` makes a parallel projection."""

    look_from: Vec3
    look_at: Vec3
    vertical_fov: t.Optional[float] = None
    up: Vec3 = (0, 1, 0)
    height: t.Optional[float] = None
    defocus_angle: float = 0.0
    focus_distance: t.Optional[float] = None
    _anonymous: t.ClassVar[bool] = True


@dataclass(frozen=True, eq=False)
class Texture:
    """Image file on materials; :class:`Texels` is one of an array."""

    file: str
    color_space: t.Literal["Srgb", "Linear"] = _word("Srgb")
    wrap: t.Literal["Repeat", "Mirror", "Clamp"] = _word("Repeat")
    filter: t.Literal["Linear", "Nearest"] = _word("Linear")
    scale: t.Tuple[float, float] = (1.0, 1.0)
    offset: t.Tuple[float, float] = (0.0, 0.0)
    rotation: float = 0.0
    _anonymous: t.ClassVar[bool] = True


@dataclass(frozen=True, eq=False)
class Texels:
    """Image of an array on materials: shape (height, width, 3), with alpha (height, width, 4), or grey
    (height, width); top row first, at most 16384 texels across and down.

    uint8 is sRGB-encoded as in an image file, or linear with ``color_space`` "Linear", which normal
    maps and roughness need. float32 is linear, 0 to 65504, and is stored in half precision (11 bits;
    values below 6.1e-5 become 0). Alpha is linear. The other fields are those of :class:`Texture`.
    """

    texels: Pixels
    color_space: t.Optional[t.Literal["Srgb", "Linear"]] = None
    wrap: t.Literal["Repeat", "Mirror", "Clamp"] = _word("Repeat")
    filter: t.Literal["Linear", "Nearest"] = _word("Linear")
    scale: t.Tuple[float, float] = (1.0, 1.0)
    offset: t.Tuple[float, float] = (0.0, 0.0)
    rotation: float = 0.0


@dataclass(frozen=True, eq=False)
class Medium:
    """Homogeneous medium: extinction per length, scattered share, mean cosine."""

    extinction: Vec3
    albedo: Vec3 = (0, 0, 0)
    anisotropy: float = 0.0
    emission: Vec3 = (0, 0, 0)
    _anonymous: t.ClassVar[bool] = True


@dataclass(frozen=True, eq=False)
class Lambertian:
    """Diffuse surface: ``albedo`` is the reflected share, which ``texture`` multiplies."""

    albedo: Vec3
    texture: t.Optional[str] = None
    emission: t.Optional[Vec3] = None
    emission_texture: t.Optional[str] = None
    two_sided: bool = False
    opacity: float = 1.0
    alpha_cutoff: t.Optional[float] = None
    medium: t.Optional[str] = None
    normal_texture: t.Optional[str] = None
    normal_scale: float = 1.0


@dataclass(frozen=True, eq=False)
class Metal:
    """Mirror, blurred by ``fuzz``."""

    albedo: Vec3
    fuzz: float = 0.0
    emission: t.Optional[Vec3] = None
    emission_texture: t.Optional[str] = None
    two_sided: bool = False
    opacity: float = 1.0
    alpha_cutoff: t.Optional[float] = None
    medium: t.Optional[str] = None
    normal_texture: t.Optional[str] = None
    normal_scale: float = 1.0


@dataclass(frozen=True, eq=False)
class Dielectric:
    """Clear glass with a smooth boundary; ``ior`` is that of the inside over the outside."""

    ior: float
    emission: t.Optional[Vec3] = None
    emission_texture: t.Optional[str] = None
    two_sided: bool = False
    opacity: float = 1.0
    alpha_cutoff: t.Optional[float] = None
    medium: t.Optional[str] = None
    normal_texture: t.Optional[str] = None
    normal_scale: float = 1.0


@dataclass(frozen=True, eq=False)
class RoughDielectric:
    """Clear glass with a rough boundary."""

    ior: float
    roughness: float
    multiple_scattering: bool = True
    emission: t.Optional[Vec3] = None
    emission_texture: t.Optional[str] = None
    two_sided: bool = False
    opacity: float = 1.0
    alpha_cutoff: t.Optional[float] = None
    medium: t.Optional[str] = None
    normal_texture: t.Optional[str] = None
    normal_scale: float = 1.0


@dataclass(frozen=True, eq=False)
class Ior:
    """Complex index of refraction of a conductor, eta + i k, by channel."""

    eta: Vec3
    k: Vec3


@dataclass(frozen=True, eq=False)
class Schlick:
    """Reflectance of a conductor at normal incidence, by channel."""

    reflectance: Vec3


@dataclass(frozen=True, eq=False)
class Conductor:
    """Rough metal."""

    fresnel: t.Union[Ior, Schlick]
    roughness: float
    multiple_scattering: bool = True
    emission: t.Optional[Vec3] = None
    emission_texture: t.Optional[str] = None
    two_sided: bool = False
    opacity: float = 1.0
    alpha_cutoff: t.Optional[float] = None
    medium: t.Optional[str] = None
    normal_texture: t.Optional[str] = None
    normal_scale: float = 1.0


@dataclass(frozen=True, eq=False)
class MetallicRoughness:
    """Material of glTF: plastic, metal, thin walls of glass."""

    base_color: Vec3 = (1, 1, 1)
    metallic: float = 1.0
    roughness: float = 1.0
    ior: float = 1.5
    transmission: float = 0.0
    texture: t.Optional[str] = None
    metallic_roughness_texture: t.Optional[str] = None
    transmission_texture: t.Optional[str] = None
    emission: t.Optional[Vec3] = None
    emission_texture: t.Optional[str] = None
    two_sided: bool = False
    opacity: float = 1.0
    alpha_cutoff: t.Optional[float] = None
    medium: t.Optional[str] = None
    normal_texture: t.Optional[str] = None
    normal_scale: float = 1.0


@dataclass(frozen=True, eq=False)
class Emissive:
    """Light with an area: emits ``radiance`` from its front, and reflects nothing."""

    radiance: Vec3
    two_sided: bool = False
    texture: t.Optional[str] = None


@dataclass(frozen=True, eq=False)
class Interface:
    """Boundary of a medium, which itself cannot be seen."""

    medium: t.Optional[str] = None


@dataclass(frozen=True, eq=False)
class Sphere:
    """Sphere."""

    center: Vec3
    radius: float
    material: str
    name: t.Optional[str] = None


@dataclass(frozen=True, eq=False)
class Spheres:
    """Spheres of one material: ``centers`` float32 of shape (n, 3), ``radii`` float32 (n,)."""

    centers: Floats
    radii: Floats
    material: str
    name: t.Optional[str] = None


@dataclass(frozen=True, eq=False)
class Quad:
    """Parallelogram with the edges ``u`` and ``v`` from ``corner``; its front is where u x v points."""

    corner: Vec3
    u: Vec3
    v: Vec3
    material: str
    name: t.Optional[str] = None


@dataclass(frozen=True, eq=False)
class Disc:
    """Disc; its front is where ``normal`` points."""

    center: Vec3
    normal: Vec3
    radius: float
    material: str
    name: t.Optional[str] = None


@dataclass(frozen=True, eq=False)
class Plane:
    """Plane through ``point``; its front is where ``normal`` points."""

    point: Vec3
    normal: Vec3
    material: str
    name: t.Optional[str] = None


@dataclass(frozen=True, eq=False)
class Box:
    """Box between two corners, after an affine ``transform`` of shape (4, 4) or (3, 4)."""

    min: Vec3
    max: Vec3
    material: str
    transform: t.Optional[Transform] = None
    name: t.Optional[str] = None


@dataclass(frozen=True, eq=False)
class Model:
    """Model of a file (.gltf .glb .obj .ply .stl), with its own materials unless one is named."""

    file: str
    material: t.Optional[str] = None
    transform: t.Optional[Transform] = None
    time: t.Optional[float] = None
    animation: t.Optional[str] = None
    variant: t.Optional[str] = None
    name: t.Optional[str] = None
    _kind: t.ClassVar[str] = "Mesh"


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles: ``positions`` float32 of shape (n, 3), ``triangles`` uint32 (m, 3), counter-clockwise
    seen from the front.

    By vertex, if given: unit ``normals`` (n, 3) for smooth shading, texture coordinates ``uvs``
    (n, 2), where (0, 0) is the image's top left, and ``colors`` (n, 4), linear, which multiply the
    material's colour and opacity. ``transform`` is affine, of shape (4, 4) or (3, 4).
    """

    positions: Floats
    triangles: Indices
    material: str
    normals: t.Optional[Floats] = None
    uvs: t.Optional[Floats] = None
    colors: t.Optional[Floats] = None
    transform: t.Optional[Transform] = None
    name: t.Optional[str] = None


@dataclass(frozen=True, eq=False)
class Point:
    """Light at a point; ``intensity`` is power per solid angle."""

    position: Vec3
    intensity: Vec3


@dataclass(frozen=True, eq=False)
class Spot:
    """Cone of light, full up to ``inner_angle`` from its axis and 0 beyond ``outer_angle``."""

    position: Vec3
    direction: Vec3
    intensity: Vec3
    inner_angle: float = 0.0
    outer_angle: float = 45.0


@dataclass(frozen=True, eq=False)
class Directional:
    """Light from far away, which travels along ``direction``."""

    direction: Vec3
    irradiance: Vec3


@dataclass(frozen=True, eq=False)
class Portal:
    """Opening through which a room sees the sky; u x v points into the room."""

    corner: Vec3
    u: Vec3
    v: Vec3
    _anonymous: t.ClassVar[bool] = True


@dataclass(frozen=True, eq=False)
class Ground:
    """Ground that catches shadows and fades out, around ``center``."""

    center: Vec3
    size: float
    _anonymous: t.ClassVar[bool] = True


@dataclass(frozen=True, eq=False)
class Uniform:
    """Sky of one radiance."""

    radiance: Vec3


@dataclass(frozen=True, eq=False)
class Gradient:
    """Sky whose radiance is linear in the height, from straight down to straight up."""

    bottom: Vec3
    top: Vec3


@dataclass(frozen=True, eq=False)
class Image:
    """Panorama of a file (.hdr .exr .pfm)."""

    file: str
    scale: float = 1.0
    rotation: float = 0.0


@dataclass(frozen=True, eq=False)
class Panorama:
    """Panorama of an array: linear radiance, float32 of shape (height, width, 3), top row up."""

    radiance: Floats
    scale: float = 1.0
    rotation: float = 0.0


@dataclass(frozen=True, eq=False)
class Studio:
    """Built-in panorama of a studio."""

    scale: float = 1.0
    rotation: float = 0.0


@dataclass(frozen=True, eq=False)
class Sun:
    """Clear sky with the sun at ``elevation`` and ``azimuth``, or in ``direction``."""

    elevation: t.Optional[float] = None
    azimuth: t.Optional[float] = None
    direction: t.Optional[Vec3] = None
    turbidity: float = 3.0
    ground_albedo: float = 0.3
    sun_disc: bool = True
    sun_radius: float = 0.2665
    scale: float = 1.0


Material = t.Union[
    Lambertian, Metal, Dielectric, RoughDielectric, Conductor, MetallicRoughness, Emissive, Interface
]
Object = t.Union[Sphere, Spheres, Quad, Disc, Plane, Box, Model, Mesh]
Light = t.Union[Point, Spot, Directional]
Sky = t.Union[Uniform, Gradient, Image, Panorama, Studio, Sun, Vec3, Floats]
