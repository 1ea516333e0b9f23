"""Text of scene files, made of Python values."""

from __future__ import annotations

import dataclasses
import json
import typing as t

import numpy as np

from . import parts

Arrays = t.Dict[str, t.Any]


def value(of: t.Any) -> str:
    """Return the text of a value in a scene file."""
    if isinstance(of, bool):
        return "true" if of else "false"
    if isinstance(of, str):
        return json.dumps(of, ensure_ascii=False)
    if isinstance(of, (int, np.integer)):
        return str(int(of))
    if isinstance(of, (float, np.floating)):
        return repr(float(of)).replace("nan", "NaN")
    if dataclasses.is_dataclass(of) and not isinstance(of, type):
        return _call(of)
    if isinstance(of, t.Mapping):
        return "{" + ", ".join(f"{value(str(k))}: {value(v)}" for k, v in of.items()) + "}"
    if isinstance(of, (tuple, list, np.ndarray)):
        return "(" + ", ".join(value(each) for each in of) + ")"
    raise TypeError(f"a scene cannot hold a {type(of).__name__}")


def value_of_field(of: t.Any) -> str:
    """Return the text of a value for an edit; a string stands for itself."""
    return of if isinstance(of, str) else value(of)


def _call(of: t.Any) -> str:
    fields = []
    for field in dataclasses.fields(of):
        content = getattr(of, field.name)
        if content is None:
            continue
        if field.metadata.get("word"):
            if not str(content).isidentifier():
                raise ValueError(f"{field.name} is {content!r}; see the scene format for its words")
            text = str(content)
        else:
            text = _transform(content) if field.name == "transform" else value(content)
        fields.append(f"{field.name}: {text}")
    name = "" if getattr(of, "_anonymous", False) else type(of).__name__
    return f"{getattr(of, '_kind', name)}({', '.join(fields)})"


def _matrix(transform: t.Any) -> np.ndarray[t.Any, np.dtype[np.float64]]:
    if transform is None:
        return np.eye(4)
    matrix = np.asarray(transform, dtype=np.float64)
    if matrix.shape == (3, 4):
        matrix = np.vstack([matrix, [0.0, 0.0, 0.0, 1.0]])
    if matrix.shape != (4, 4):
        raise ValueError(f"transform has shape {matrix.shape}; it must be (4, 4) or (3, 4)")
    if not np.isfinite(matrix).all():
        raise ValueError("transform must be finite")
    if not np.array_equal(matrix[3], [0.0, 0.0, 0.0, 1.0]):
        raise ValueError("the last row of transform must be (0, 0, 0, 1): it is an affine map")
    return matrix


def _transform(transform: t.Any) -> str:
    rows = ", ".join(value(row) for row in _matrix(transform)[:3])
    return f"[Matrix(({rows}))]"


def _array(of: t.Any, dtype: t.Any) -> t.Any:
    # Lists are converted; arrays are taken as they are, so that a wrong type is noticed.
    return np.asarray(of, dtype=dtype) if isinstance(of, (list, tuple)) else of


def scene(
    *,
    camera: parts.Camera,
    materials: t.Mapping[str, parts.Material],
    objects: t.Sequence[parts.Object] = (),
    lights: t.Sequence[parts.Light] = (),
    sky: t.Any = None,
    textures: t.Optional[t.Mapping[str, parts.Texture]] = None,
    media: t.Optional[t.Mapping[str, parts.Medium]] = None,
    atmosphere: t.Optional[str] = None,
    portals: t.Sequence[parts.Portal] = (),
    ground: t.Optional[parts.Ground] = None,
    width: int = 640,
    height: int = 360,
    spp: int = 64,
    depth: int = 50,
    about: str = "",
) -> t.Tuple[str, Arrays]:
    """Return the text of a scene, and its parts that are arrays."""
    arrays: Arrays = {"meshes": [], "spheres": [], "sky": None}
    names = list(materials)
    described: t.List[str] = []
    for index, part in enumerate(objects):
        place = f"objects[{index}]"
        if not dataclasses.is_dataclass(part):
            raise TypeError(f"{place} is a {type(part).__name__}, not an object of trisect")
        material = getattr(part, "material", None)
        if material is not None and material not in materials:
            raise ValueError(f"{place} has the material {material!r}; materials has {names}")
        if isinstance(part, parts.Mesh):
            columns = _matrix(part.transform)[:3].T.reshape(-1)
            arrays["meshes"].append(
                {
                    "positions": _array(part.positions, np.float32),
                    "triangles": _array(part.triangles, np.uint32),
                    "normals": _array(part.normals, np.float32),
                    "uvs": _array(part.uvs, np.float32),
                    "colors": _array(part.colors, np.float32),
                    "material": names.index(part.material),
                    "transform": columns.tolist(),
                    "name": part.name,
                }
            )
        elif isinstance(part, parts.Spheres):
            arrays["spheres"].append(
                {
                    "centers": _array(part.centers, np.float32),
                    "radii": _array(part.radii, np.float32),
                    "material": names.index(part.material),
                    "name": part.name,
                }
            )
        else:
            described.append(value(part))
    if isinstance(sky, np.ndarray) and sky.ndim == 3:
        sky = parts.Panorama(sky)
    if isinstance(sky, parts.Panorama):
        arrays["sky"] = {"radiance": sky.radiance, "scale": sky.scale, "rotation": sky.rotation}
        sky = None
    if sky is not None and not dataclasses.is_dataclass(sky):
        sky = parts.Uniform(sky)
    fields = [
        "version: 1",
        f"about: {value(about)}",
        f"image: (width: {value(width)}, height: {value(height)}, samples: {value(spp)}, depth: {value(depth)})",
        f"camera: {value(camera)}",
        f"sky: {value(sky)}" if sky is not None else "sky: Black",
        f"ground: {value(ground)}" if ground is not None else "",
        f"textures: {value(textures)}" if textures else "",
        f"media: {value(media)}" if media else "",
        f"atmosphere: {value(atmosphere)}" if atmosphere is not None else "",
        f"materials: {value(materials)}",
        "objects: [\n        " + ",\n        ".join(described) + "\n    ]",
        "lights: [" + ", ".join(value(light) for light in lights) + "]",
        "portals: [" + ", ".join(value(portal) for portal in portals) + "]",
    ]
    text = "Scene(\n    " + ",\n    ".join(field for field in fields if field) + ",\n)\n"
    return text, arrays
