"""Text of scene files, made of Python values."""

from __future__ import annotations

import collections.abc
import dataclasses
import typing as t

import numpy as np

from . import parts

Arrays = t.Dict[str, t.Any]


def value(of: t.Any) -> str:
    """Return the text of a value in a scene file."""
    if isinstance(of, (bool, np.bool_)):
        return "true" if of else "false"
    if isinstance(of, str):
        return _string(of)
    if isinstance(of, np.ndarray) and of.ndim == 0:
        return value(of.item())
    if isinstance(of, (int, np.integer)):
        return str(int(of))
    if isinstance(of, (float, np.floating)):
        return repr(float(of)).replace("nan", "NaN")
    if dataclasses.is_dataclass(of) and not isinstance(of, type):
        return _call(of)
    if isinstance(of, collections.abc.Mapping):
        return "{" + ", ".join(f"{value(str(k))}: {value(v)}" for k, v in of.items()) + "}"
    if isinstance(of, (tuple, list, np.ndarray)):
        return "(" + ", ".join(value(each) for each in of) + ")"
    raise TypeError(f"a scene cannot hold a {type(of).__name__}")


def _string(of: str) -> str:
    escapes = {'"': '\\"', "\\": "\\\\"}
    return '"' + "".join(escapes.get(c) or (c if c >= " " else f"\\u{{{ord(c):x}}}") for c in of) + '"'


def value_of_field(of: t.Any, path: str) -> str:
    """Return the text of a value for the edit of a field; a string stands for itself."""
    if isinstance(of, str):
        return of
    if path.rpartition(".")[2] == "transform":
        return _transform(of)
    if path == "sky" and not dataclasses.is_dataclass(of):
        of = parts.Uniform(of)
    return value(of)


def _call(of: t.Any) -> str:
    if isinstance(of, (parts.Mesh, parts.Spheres, parts.Panorama, parts.Texels)):
        raise TypeError(f"a {type(of).__name__} of arrays cannot be a value here; build the scene again")
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


def array_object(part: t.Any, name: str) -> t.Optional[t.Tuple[str, t.Dict[str, t.Any]]]:
    """Return the kind and the fields of an object of arrays, None for another part."""
    if not isinstance(part, (parts.Mesh, parts.Spheres)):
        return None
    fields = {
        field.name: array_value(field.name, getattr(part, field.name)) for field in dataclasses.fields(part)
    }
    fields["name"] = part.name or name
    return "Mesh" if isinstance(part, parts.Mesh) else "Spheres", fields


def array_value(name: str, of: t.Any) -> t.Any:
    """Return the value of a field of an object of arrays: an array, or the columns of a transform."""
    if name == "transform":
        return of if isinstance(of, str) else _matrix(of)[:3].T.reshape(-1).tolist()
    if name in ("material", "name"):
        return of
    return _array(name, of, np.uint32 if name == "triangles" else np.float32)


def panorama(sky: t.Any) -> t.Optional[t.Dict[str, t.Any]]:
    """Return the fields of a sky that is an array, None for another sky."""
    if isinstance(sky, np.ndarray) and sky.ndim > 1:
        sky = parts.Panorama(sky)
    if not isinstance(sky, parts.Panorama):
        return None
    return {"radiance": sky.radiance, "scale": sky.scale, "rotation": sky.rotation}


def texture_of_array(name: str, of: t.Any) -> t.Optional[t.Tuple[str, str, t.Any]]:
    """Return the text of a texture that is an array, the file that it stands for, and the array.

    None for another texture.
    """
    if isinstance(of, np.ndarray):
        of = parts.Texels(of)
    if not isinstance(of, parts.Texels):
        return None
    is_float = getattr(of.texels, "dtype", None) == np.float32
    if is_float and of.color_space == "Srgb":
        raise ValueError(f"textures.{name} is float32, which is linear; leave color_space out, or pass uint8")
    file = f"<array {name}>"
    texture = parts.Texture(
        file,
        color_space=of.color_space or ("Linear" if is_float else "Srgb"),
        wrap=of.wrap,
        filter=of.filter,
        scale=of.scale,
        offset=of.offset,
        rotation=of.rotation,
    )
    return value(texture), file, of.texels


def _textures(textures: t.Optional[t.Mapping[str, t.Any]], arrays: Arrays) -> str:
    described = []
    for name, texture in (textures or {}).items():
        of_array = texture_of_array(str(name), texture)
        if of_array is not None:
            text, file, texels = of_array
            arrays["textures"].append((str(name), file, texels))
        else:
            text = value(texture)
        described.append(f"{value(str(name))}: {text}")
    return "textures: {" + ", ".join(described) + "}" if described else ""


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


def _array(name: str, of: t.Any, dtype: t.Any) -> t.Any:
    # Lists are converted; arrays are taken as they are, so that a wrong type is noticed.
    if not isinstance(of, (list, tuple)):
        return of
    found = np.asarray(of)
    if dtype is np.uint32 and found.size:
        if found.dtype.kind not in "iu" or found.min() < 0 or found.max() > 0xFFFFFFFF:
            raise ValueError(f"{name} must be whole numbers from 0 to 4294967295")
    try:
        return found.astype(dtype)
    except (TypeError, ValueError):
        raise TypeError(f"{name} must be numbers, in rows of equal length") from None


def scene(
    *,
    camera: parts.Camera,
    materials: t.Mapping[str, parts.Material],
    objects: t.Sequence[parts.Object] = (),
    lights: t.Sequence[parts.Light] = (),
    sky: t.Any = None,
    textures: t.Optional[t.Mapping[str, t.Union[parts.Texture, parts.Texels, parts.Pixels]]] = None,
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
    # Objects of arrays, and for each object whether it is one, with its number among its kind.
    arrays: Arrays = {"objects": [], "places": [], "textures": [], "sky": panorama(sky)}
    names = list(materials)
    for name in names:
        if not isinstance(name, str):
            raise TypeError(f"materials has the name {name!r}; names must be str")
    described: t.List[str] = []
    for index, part in enumerate(objects):
        place = f"objects[{index}]"
        if not dataclasses.is_dataclass(part):
            raise TypeError(f"{place} is a {type(part).__name__}, not an object of trisect")
        material = getattr(part, "material", None)
        needs_material = not isinstance(part, parts.Model)
        if (material is not None or needs_material) and material not in materials:
            raise ValueError(f"{place} has the material {material!r}; materials has {names}")
        of_arrays = array_object(part, place)
        if of_arrays is not None:
            arrays["places"].append((True, len(arrays["objects"])))
            arrays["objects"].append(of_arrays)
        else:
            if not hasattr(part, "name"):
                raise TypeError(f"{place} is a {type(part).__name__}, not an object of trisect")
            if part.name is None and not isinstance(part, parts.Model):
                part = dataclasses.replace(part, name=place)
            arrays["places"].append((False, len(described)))
            described.append(value(part))
    if arrays["sky"] is not None:
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
        _textures(textures, arrays),
        f"media: {value(media)}" if media else "",
        f"atmosphere: {value(atmosphere)}" if atmosphere is not None else "",
        f"materials: {value(materials)}",
        "objects: [\n        " + ",\n        ".join(described) + "\n    ]",
        "lights: [" + ", ".join(value(light) for light in lights) + "]",
        "portals: [" + ", ".join(value(portal) for portal in portals) + "]",
    ]
    text = "Scene(\n    " + ",\n    ".join(field for field in fields if field) + ",\n)\n"
    return text, arrays
