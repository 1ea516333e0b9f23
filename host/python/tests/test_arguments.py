"""Bad arguments: wrong shapes, types, strides and values are exceptions that name the argument."""

import numpy as np
import pytest

import trisect
from test_scenes import small, square

POSITIONS = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0]], np.float32)
TRIANGLES = np.array([[0, 1, 2]], np.uint32)


def mesh(**fields):
    return small(objects=[trisect.Mesh(**{"positions": POSITIONS, "triangles": TRIANGLES, "material": "red", **fields})])


@pytest.mark.parametrize(
    "fields, kind, text",
    [
        ({"positions": POSITIONS.astype(np.float64)}, TypeError, "positions must be a float32 array of shape .n, 3., not an array of float64"),
        ({"positions": POSITIONS.astype(">f4")}, TypeError, "positions must be"),
        ({"positions": POSITIONS[:, :2].copy()}, ValueError, r"positions has shape \[3, 2\]"),
        ({"positions": POSITIONS.ravel()}, TypeError, "with shape .9,."),
        ({"positions": np.repeat(POSITIONS, 2, axis=0)[::2]}, ValueError, "not contiguous in memory, row by row"),
        ({"positions": np.where(POSITIONS == 0, np.nan, POSITIONS)}, ValueError, "positions has NaN as its value 2"),
        ({"positions": "file.obj"}, TypeError, "positions"),
        ({"triangles": TRIANGLES.astype(np.int64)}, TypeError, "triangles must be a uint32 array"),
        ({"triangles": TRIANGLES + 1}, ValueError, "triangles has the index 3, and positions has 3"),
        ({"normals": POSITIONS[:2]}, ValueError, "normals has 2 rows, and positions has 3"),
        ({"uvs": POSITIONS}, ValueError, r"uvs has shape \[3, 3\]"),
        ({"transform": np.eye(3)}, ValueError, "transform has shape"),
        ({"transform": np.full((4, 4), np.inf)}, ValueError, "transform must be finite"),
        ({"material": "blue"}, ValueError, "objects.0. has the material 'blue'; materials has"),
    ],
)
def test_meshes(fields, kind, text):
    with pytest.raises(kind, match=text):
        mesh(**fields)


def test_arrays_in_the_order_of_fortran_are_refused():
    good = np.random.default_rng(0).random((4, 8, 3), np.float32)
    for call in [
        lambda: mesh(positions=np.asfortranarray(POSITIONS)),
        lambda: trisect.compare(good, np.asfortranarray(good)),
        lambda: small(sky=np.asfortranarray(good)),
    ]:
        with pytest.raises(ValueError, match='row by row; pass numpy.require.*"CA"'):
            call()


def test_indices_are_whole_numbers():
    for triangles in [[[0.9, 1.7, 2.2]], [[-1, 0, 1]], [[0, 1, 2**40]]]:
        with pytest.raises(ValueError, match="triangles must be whole numbers"):
            mesh(triangles=triangles)
    with pytest.raises(TypeError, match="positions must be numbers"):
        mesh(positions=[["a", "b", "c"]])


def test_lists_and_read_only_arrays_are_taken():
    frozen = POSITIONS.copy()
    frozen.flags.writeable = False
    scenes = [mesh(positions=frozen), mesh(positions=POSITIONS.tolist(), triangles=[[0, 1, 2]])]
    assert scenes[0].digest == scenes[1].digest == mesh().digest


def test_spheres_and_skies():
    centers, radii = np.zeros((2, 3), np.float32), np.ones(2, np.float32)
    make = lambda **fields: small(objects=[trisect.Spheres(**{"centers": centers, "radii": radii, "material": "red", **fields})])
    assert make().primitives == 2
    for fields, kind, text in [
        ({"radii": radii[:1]}, ValueError, "radii has 1 values"),
        ({"radii": -radii}, ValueError, "radii has -1 as its value 0; all must be above 0"),
        ({"radii": radii.astype(np.float64)}, TypeError, "radii must be a float32"),
        ({"centers": centers + np.float32(np.inf)}, ValueError, "centers has inf"),
    ]:
        with pytest.raises(kind, match=text):
            make(**fields)
    for sky, kind in [
        (np.zeros((4, 8, 3)), TypeError),
        (np.zeros((4, 8, 4), np.float32), ValueError),
        (-np.ones((4, 8, 3), np.float32), ValueError),
        (np.zeros((4, 8, 3), np.float32)[:, ::2], ValueError),
    ]:
        with pytest.raises(kind, match="sky"):
            small(sky=sky)


def test_numbers_of_a_scene():
    for arguments, text in [
        ({"width": 0}, "width"),
        ({"width": 2.5}, "width"),
        ({"objects": [trisect.Sphere((0, 0, 0), -1, "grey")]}, "radius"),
        ({"objects": [trisect.Sphere((0, float("nan"), 0), 1, "grey")]}, "center"),
        ({"materials": {"grey": trisect.Lambertian((2, 0, 0))}}, "albedo"),
        ({"camera": trisect.Camera((0, 0, 0), (0, 0, 0), 40)}, "look_at|look_from"),
    ]:
        with pytest.raises(trisect.SceneError, match=text):
            small(**arguments)
    with pytest.raises(TypeError, match="not an object of trisect"):
        small(objects=["ball"])
    with pytest.raises(TypeError):
        trisect.Scene(materials={})


def test_arguments_of_a_render():
    renderer = trisect.Renderer(small(), "cpu")
    for arguments, text in [
        ({"spp": 0}, "spp is 0; it must be a whole number"),
        ({"spp": -3}, "spp is -3"),
        ({"spp": "many"}, "spp is 'many'"),
        ({"seed": -1}, "seed is -1"),
        ({"width": 2**40}, "width is 1099511627776"),
        ({"spp": True}, "spp is True"),
        ({"budget": True}, "budget is True"),
        ({"clamp": True}, "clamp is True"),
        ({"spp": 1, "max_spp": 4}, "max_spp has no effect without target_error"),
        ({"spp": 1, "adaptive": "on"}, "adaptive has no effect"),
        ({"roulette": False, "roulette_depth": 3}, "roulette_depth has no effect"),
        ({"width": 10**6, "height": 10**6}, "memory|pixels"),
        ({"depth": 10**6}, "depth"),
        ({"clamp": 0}, "clamp is 0"),
        ({"clamp": float("nan")}, "clamp is nan"),
        ({"sampler": "halton"}, "it must be one of sobol, independent"),
        ({"denoise": "best"}, "off, atrous, svgf, oidn"),
        ({"aov": ["depht"]}, "aov is 'depht'"),
        ({"aov": "motion"}, "a frame alone has no motion"),
        ({"budget": "soon"}, "budget is 'soon'; write it as seconds"),
        ({"budget": -1}, "budget is -1"),
        ({"target_error": 2}, "target_error is 2"),
        ({"target_error": "nan%"}, "target_error"),
        ({"crop": (0, 0, 0, 1)}, "crop is"),
        ({"crop": (0, 0, 99, 1)}, "crop|columns"),
        ({"crop": "left"}, "crop is 'left'"),
        ({"progress": 3}, "progress is 3"),
        ({"budget": 1, "target_error": 0.1}, "cannot be combined"),
    ]:
        with pytest.raises(trisect.SettingsError, match=text):
            renderer.render(**arguments)
    with pytest.raises(TypeError, match="unexpected keyword argument .samples."):
        renderer.render(samples=3)
    # All errors came before any work: the renderer still renders.
    assert renderer.render().complete


def test_backends():
    for arguments, text in [(("vulkan",), "auto, cpu, wgpu, cuda"), ((3,), "backend must be one of")]:
        with pytest.raises((trisect.SettingsError, TypeError), match=text):
            trisect.Renderer(small(), *arguments)
    with pytest.raises(trisect.BackendError):
        trisect.Renderer(small(), "cpu", device=7)
    with pytest.raises((trisect.BackendError, OverflowError)):
        trisect.Renderer(small(), "cpu", threads=-1)
    with pytest.raises(trisect.SettingsError, match="threads must be from 1 to 1024"):
        trisect.Renderer(small(), "cpu", threads=20_000)
    with pytest.raises(TypeError):
        trisect.Renderer("scene.ron")


def test_images():
    good = np.zeros((4, 8, 3), np.float32)
    for image, kind, text in [
        (good.astype(np.float64), TypeError, "image must be a float32 array"),
        (good[..., :2].copy(), ValueError, "image has shape"),
        (good[:, ::2], ValueError, "image is not contiguous"),
        (good[0], TypeError, "image must be"),
        (good[:0], trisect.MetricsError, "no pixel"),
        (3, TypeError, "image must be a frame"),
        ("missing.exr", trisect.ImageError, "missing.exr"),
    ]:
        with pytest.raises(kind, match=text):
            trisect.compare(image, good)
    nan = good.copy()
    nan[0, 0, 0] = np.nan
    assert trisect.compare(nan, good)["non_finite"] == 1


def test_files(tmp_path):
    frame = trisect.Renderer(small(), "cpu").render(1)
    for path, arguments, kind, text in [
        ("a.gif", {}, trisect.ImageError, "unknown image format"),
        (tmp_path / "no" / "a.png", {}, trisect.ImageError, "No such file"),
        ("-", {}, trisect.SettingsError, "name a file"),
        (tmp_path / "a.png", {"bits": 12}, trisect.SettingsError, "bits is 12"),
        (tmp_path / "a.jpg", {"bits": 16}, trisect.ImageError, "16"),
        (tmp_path / "a.png", {"gamma": 0}, trisect.SettingsError, "gamma"),
        (tmp_path / "a.exr", {"tonemap": "agx"}, trisect.ImageError, "tonemap"),
        (tmp_path / "a.png", {"tonemap": "pretty"}, trisect.SettingsError, "none, filmic, agx, aces"),
        (tmp_path / "a.png", {"exposure": "bright"}, trisect.SettingsError, "exposure"),
    ]:
        with pytest.raises(kind, match=text):
            frame.save(path, **arguments)
    assert list(tmp_path.iterdir()) == []
