"""Textures of arrays: they are those of image files, and wrong arrays are named."""

import pickle
import struct
import zlib

import numpy as np
import pytest

import trisect
from test_scenes import color, small, square

UVS = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)
WHITE = trisect.Lambertian((1, 1, 1), texture="wood")


def textured(texture, material=WHITE):
    """Scene of a square that shows a texture."""
    return small(textures={"wood": texture}, materials={"red": material}, objects=[square(uvs=UVS)])


def texels(*shape):
    return np.random.default_rng(1).integers(0, 256, shape, np.uint8)


def write_png(path, image):
    """Writes uint8 pixels without a filter, by the PNG specification."""
    height, width = image.shape[:2]
    kind = {2: 0, 3: {3: 2, 4: 6}.get(image.shape[-1])}[image.ndim]
    rows = b"".join(b"\0" + row.tobytes() for row in image)
    chunk = lambda name, data: struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    header = struct.pack(">IIBBBBB", width, height, 8, kind, 0, 0, 0)
    chunks = [chunk(b"IHDR", header), chunk(b"IDAT", zlib.compress(rows)), chunk(b"IEND", b"")]
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(chunks))


@pytest.mark.parametrize("shape", [(5, 7), (5, 7, 3), (5, 7, 4)])
@pytest.mark.parametrize("space", ["Srgb", "Linear"])
def test_an_array_is_the_texture_of_a_png(shape, space, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    image = texels(*shape)
    write_png(tmp_path / "wood.png", image)
    fields = dict(color_space=space, wrap="Mirror", filter="Nearest", scale=(2, 3), offset=(0.5, 0), rotation=30)
    of_file = textured(trisect.Texture("wood.png", **fields))
    of_array = textured(trisect.Texels(image, **fields))
    assert of_array.digest == of_file.digest
    pixels = [trisect.Renderer(scene, "cpu").render(4).image for scene in (of_file, of_array)]
    assert np.array_equal(*pixels)
    # Negative control: another texel.
    image[2, 3] ^= 128
    assert textured(trisect.Texels(image, **fields)).digest != of_file.digest


def test_an_array_alone_is_a_texture():
    image = np.zeros((2, 2, 3), np.uint8)
    image[..., 1] = 255
    assert textured(image).digest == textured(trisect.Texels(image)).digest
    assert np.allclose(color(textured(image)), (0, 1, 0), atol=1e-3)


def test_float_is_linear():
    half = np.full((4, 4, 3), 0.5, np.float32)
    assert np.allclose(color(textured(half)), 0.5, atol=1e-3)
    assert np.allclose(color(textured(np.full((4, 4, 3), 128, np.uint8))), 0.2158, atol=1e-3)
    assert np.allclose(color(textured(trisect.Texels(np.full((4, 4), 128, np.uint8), "Linear"))), 0.5019, atol=1e-3)
    # What half precision cannot hold is rounded.
    assert textured(half).digest == textured(half * np.float32(1 + 1e-5)).digest
    assert textured(half).digest != textured(half * np.float32(1 + 1e-3)).digest


def test_float_holds_numbers():
    material = trisect.MetallicRoughness(metallic_roughness_texture="wood")
    assert textured(np.full((2, 2, 3), 0.5, np.float32), material).primitives == 2
    assert textured(trisect.Texels(texels(2, 2, 3), "Linear"), material).primitives == 2
    with pytest.raises(trisect.SceneError, match='texture "wood" holds numbers here, not colours'):
        textured(texels(2, 2, 3), material)


GOOD = np.full((4, 6, 3), 0.5, np.float32)


@pytest.mark.parametrize(
    "image, kind, text",
    [
        (GOOD.astype(np.float64), TypeError, "textures.wood must be a uint8 or float32 array .*, not an array of float64"),
        (GOOD.astype(np.uint16), TypeError, "not an array of uint16"),
        (GOOD.astype(">f4"), TypeError, "textures.wood must be a uint8 or float32 array"),
        (GOOD.astype(bool), TypeError, "not an array of bool"),
        (GOOD[..., :2].copy(), ValueError, r"textures.wood has shape \[4, 6, 2\]; it must be .height, width."),
        (GOOD[0, 0], ValueError, r"has shape \[3\]"),
        (GOOD[None], ValueError, r"has shape \[1, 4, 6, 3\]"),
        (np.float32(3) * np.ones(()), TypeError, "textures.wood"),
        (GOOD[:0], ValueError, r"has shape \[0, 4, 6, 3\]|has shape \[0, 6, 3\].*from 1 to 16384"),
        (GOOD[:, :0], ValueError, r"has shape \[4, 0, 3\]"),
        (np.zeros((1, 16385), np.uint8), ValueError, r"has shape \[1, 16385\].*from 1 to 16384"),
        (np.where(GOOD > 0, np.float32("nan"), GOOD), ValueError, "textures.wood has NaN as its value 0; all must be finite"),
        (GOOD * np.float32("inf"), ValueError, "has inf as its value 0"),
        (-GOOD, ValueError, "has -0.5 as its value 0; all must be from 0 to 65504"),
        (GOOD * 200_000, ValueError, "has 100000 as its value 0"),
        (GOOD[:, ::2], ValueError, "textures.wood is not contiguous in memory, row by row; pass numpy.require"),
        (GOOD[::-1], ValueError, "not contiguous"),
        (np.asfortranarray(GOOD), ValueError, "not contiguous"),
        (np.broadcast_to(GOOD[:1], (4, 6, 3)), ValueError, "not contiguous"),
    ],
)
def test_wrong_arrays_are_named(image, kind, text):
    with pytest.raises(kind, match=text):
        textured(trisect.Texels(image))


def test_other_wrong_textures_are_named():
    for texture, kind, text in [
        (trisect.Texels(GOOD, "Srgb"), ValueError, "textures.wood is float32, which is linear"),
        (trisect.Texels("wood.png"), TypeError, "textures.wood must be .*, not str"),
        (trisect.Texels([[0, 1]]), TypeError, "textures.wood must be .*, not list"),
        (trisect.Texels(GOOD, wrap="Tile"), trisect.SceneError, "Tile"),
        (trisect.Texels(GOOD, scale=(0, float("inf"))), trisect.SceneError, "scale|inf"),
    ]:
        with pytest.raises(kind, match=text):
            textured(texture)


def test_read_only_arrays_are_taken_and_copied():
    image = texels(4, 4, 3)
    digest = textured(image.copy()).digest
    image.flags.writeable = False
    scene = textured(image)
    assert scene.digest == digest
    image.flags.writeable = True
    image[:] = 0
    assert np.array_equal(color(scene), color(textured(texels(4, 4, 3))))


def test_scenes_with_textures_of_arrays_go_to_other_processes():
    scene = textured(texels(4, 4, 3))
    copy = pickle.loads(pickle.dumps(scene))
    assert copy.digest == scene.digest
    assert np.array_equal(color(copy), color(scene))


def test_edits_reach_textures():
    image, other = texels(4, 4, 3), 255 - texels(4, 4, 3)
    scene = textured(image)
    for edited, expected in [
        (scene.edit({"textures.wood": other}), textured(other)),
        (scene.edit({"textures.wood.texels": other}), textured(other)),
        (scene.edit({"textures.wood.wrap": "Clamp"}), textured(trisect.Texels(image, wrap="Clamp"))),
        (scene.edit({"textures.wood.color_space": "Linear"}), textured(trisect.Texels(image, "Linear"))),
        (scene.edit({"textures.wood": trisect.Texels(other, filter="Nearest")}), textured(trisect.Texels(other, filter="Nearest"))),
        (scene.edit({"textures.wood": other}).edit({"textures.wood": image}), scene),
    ]:
        assert edited.digest == expected.digest
    assert scene.edit({"textures.wood": other}).digest != scene.digest
    with pytest.raises(trisect.SceneError, match="textures.oak.texels: oak is no texture of an array"):
        scene.edit({"textures.oak.texels": other})
    with pytest.raises(TypeError, match="textures.wood must be a uint8 or float32 array"):
        scene.edit({"textures.wood.texels": other.astype(np.int64)})


def test_a_file_becomes_an_array(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_png(tmp_path / "wood.png", texels(4, 4, 3))
    of_file = textured(trisect.Texture("wood.png"))
    other = 255 - texels(4, 4, 3)
    assert of_file.edit({"textures.wood": other}).digest == textured(other).digest
    assert textured(other).edit({"textures.wood": trisect.Texture("wood.png")}).digest == of_file.digest


def test_renderers_take_other_texels():
    scene = textured(texels(4, 4, 3))
    renderer = trisect.Renderer(scene, "cpu")
    changed = scene.edit({"textures.wood": 255 - texels(4, 4, 3)})
    told = renderer.update(changed)
    assert told["tree"] == "kept" and not {"triangles", "vertices", "nodes"} & set(told["written"])
    assert np.array_equal(renderer.render().image, trisect.Renderer(changed, "cpu").render().image)
