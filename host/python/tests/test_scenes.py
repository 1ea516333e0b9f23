"""Scenes: built of parts, read, edited, sent to other processes."""

import concurrent.futures
import copy as copy_module
import multiprocessing
import pickle
import warnings

import numpy as np
import pytest

import trisect


def small(**changes):
    arguments = dict(
        camera=trisect.Camera(look_from=(0, 0, 4), look_at=(0, 0, 0), vertical_fov=40),
        materials={"grey": trisect.Lambertian((0.5, 0.5, 0.5)), "red": trisect.Lambertian((0.8, 0.1, 0.1))},
        objects=[trisect.Sphere((0, 0, 0), 1, "grey", name="ball")],
        sky=(1, 1, 1),
        width=32,
        height=32,
        spp=4,
    )
    arguments.update(changes)
    return trisect.Scene(**arguments)


def square(material="red", **fields):
    positions = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
    triangles = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
    return trisect.Mesh(positions, triangles, material, **fields)


def color(scene):
    """Colour of the middle of the image."""
    return trisect.Renderer(scene, "cpu").render(aov="albedo").aovs["albedo"][16, 16]


def test_a_scene_of_parts():
    scene = small()
    assert scene.primitives == 1 and scene.objects == ["ball"] and scene.size == (32, 32) and scene.spp == 4
    assert np.allclose(color(scene), 0.5)


def test_every_part_is_read():
    every = [
        trisect.Metal((0.9, 0.8, 0.7), fuzz=0.1),
        trisect.Dielectric(1.5, opacity=0.5),
        trisect.RoughDielectric(1.5, 0.2, multiple_scattering=False),
        trisect.Conductor(trisect.Ior((0.1, 0.4, 1.4), (4, 2.4, 1.6)), 0.25),
        trisect.Conductor(trisect.Schlick((0.9, 0.9, 0.9)), 0.25),
        trisect.MetallicRoughness((0.3, 0.2, 0.1), metallic=0, emission=(1, 0, 0), two_sided=True),
        trisect.Emissive((5, 5, 5)),
        trisect.Interface(medium="smoke"),
    ]
    materials = {f"m{index}": material for index, material in enumerate(every)}
    materials["grey"] = trisect.Lambertian((0.5, 0.5, 0.5))
    objects = [trisect.Sphere((index, 0, 0), 0.4, f"m{index}") for index in range(len(every))]
    turn = [[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 3]]
    objects += [
        trisect.Quad((0, 0, -3), (1, 0, 0), (0, 1, 0), "grey"),
        trisect.Disc((0, 0, -4), (0, 0, 1), 2, "grey"),
        trisect.Plane((0, -2, 0), (0, 1, 0), "grey"),
        trisect.Box((-1, -1, -1), (0, 0, 0), "grey", transform=turn),
        trisect.Spheres(np.zeros((3, 3), np.float32) + [[0, 5, 0]], np.ones(3, np.float32), "grey", name="three")
        if False
        else trisect.Spheres(np.float32([[0, 5, 0], [2, 5, 0]]), np.float32([1, 0.5]), "grey", name="two"),
        square("grey", transform=np.eye(4), name="mesh"),
    ]
    scene = small(
        materials=materials,
        objects=objects,
        lights=[
            trisect.Point((0, 3, 0), (4, 4, 4)),
            trisect.Spot((0, 3, 0), (0, -1, 0), (4, 4, 4), inner_angle=10),
            trisect.Directional((0, -1, 0), (1, 1, 1)),
        ],
        media={"smoke": trisect.Medium((1, 1, 1), albedo=(0.5, 0.5, 0.5))},
        sky=trisect.Gradient((1, 1, 1), (0.5, 0.7, 1)),
    )
    assert {"mesh", "two"} <= set(scene.objects)
    assert trisect.Renderer(scene, "cpu").render(1).complete
    for sky in [trisect.Studio(), trisect.Sun(elevation=30), trisect.Uniform((1, 1, 1)), None]:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", trisect.SceneWarning)
            assert trisect.Renderer(small(sky=sky), "cpu").render(1).complete


def test_meshes_and_panoramas_are_arrays():
    scene = small(objects=[square(transform=[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1]])])
    assert np.allclose(color(scene), (0.8, 0.1, 0.1), atol=1e-3)
    radiance = np.zeros((8, 16, 3), np.float32)
    radiance[..., 2] = 3
    image = trisect.Renderer(small(objects=[], sky=radiance), "cpu").render(1).image
    assert np.allclose(image, (0, 0, 3), rtol=1e-3)


def test_edits_make_other_scenes():
    scene = small()
    other = scene.edit({"materials.grey.albedo": (0.1, 0.2, 0.3), "camera.vertical_fov": 20})
    assert np.allclose(color(other), (0.1, 0.2, 0.3), atol=1e-3) and np.allclose(color(scene), 0.5)
    assert np.allclose(color(other.edit({"objects.ball.material": "red"})), (0.8, 0.1, 0.1), atol=1e-3)
    with pytest.raises(trisect.SceneError, match="alb"):
        scene.edit({"materials.grey.albdo": 1})
    with pytest.raises(trisect.SceneError):
        scene.edit({"materials": "("})


def test_renderers_take_edited_scenes():
    scene = small(objects=[square()])
    renderer = trisect.Renderer(scene, "cpu")
    before = renderer.render().image
    changed = scene.edit({"materials.red.albedo": (0.1, 0.1, 0.9)})
    told = renderer.update(changed)
    # An edit of a material writes no mesh.
    assert told["tree"] == "kept" and set(told["written"]) == {"materials"}
    assert renderer.scene is changed
    after = renderer.render().image
    assert not np.array_equal(before, after)
    assert np.array_equal(after, trisect.Renderer(changed, "cpu").render().image)


def test_edits_read_no_file_again(tmp_path):
    model = tmp_path / "square.obj"
    model.write_text("v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n")
    path = tmp_path / "a.ron"
    path.write_text(
        "Scene(version: 1, image: (width: 32, height: 32), sky: Uniform(radiance: (1, 1, 1)),"
        " camera: (look_from: (0, 0, 4), look_at: (0, 0, 0), vertical_fov: 40),"
        " materials: { \"red\": Lambertian(albedo: (0.8, 0.1, 0.1)) },"
        " objects: [Mesh(file: \"square.obj\", material: \"red\", name: \"square\")])"
    )
    scene = trisect.Scene.load(path)
    first = scene.edit({"materials.red.albedo": (0.1, 0.1, 0.8)})
    model.unlink()
    second = scene.edit({"materials.red.albedo": (0.1, 0.8, 0.1)})
    for edited, expected in [(scene, (0.8, 0.1, 0.1)), (first, (0.1, 0.1, 0.8)), (second, (0.1, 0.8, 0.1))]:
        assert np.allclose(color(edited), expected, atol=1e-3)
        assert edited.objects == ["square"]
    renamed = second.edit({"objects.square.name": "window"})
    assert renamed.objects == ["window"] and np.allclose(color(renamed), (0.1, 0.8, 0.1), atol=1e-3)


def test_scenes_go_to_other_processes():
    scene = small(objects=[square()])
    copy = pickle.loads(pickle.dumps(scene))
    assert copy.digest == scene.digest and copy.size == scene.size
    assert copy.objects == scene.objects and copy.objects
    with pytest.raises(trisect.SceneError, match="made of bytes"):
        copy.edit({"image.samples": 1})
    context = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(1, mp_context=context) as pool:
        digest = pool.submit(digest_of, scene).result(timeout=60)
    assert digest == scene.digest
    renderer = trisect.Renderer(scene, "cpu")
    for unpicklable in [renderer, renderer.render(1), renderer.render(1).film]:
        with pytest.raises(TypeError):
            pickle.dumps(unpicklable)


def digest_of(scene):
    return scene.digest


def test_copies_are_the_scene():
    scene = small()
    assert copy_module.copy(scene) is scene and copy_module.deepcopy([scene])[0] is scene


def test_edits_take_what_constructors_take():
    box = trisect.Box((-1, -1, -1), (1, 1, 1), "grey", name="box")
    scene = small(objects=[box])
    with pytest.warns(trisect.SceneWarning, match="nothing in view"):
        moved = scene.edit({"objects.box.transform": [[1, 0, 0, 9], [0, 1, 0, 0], [0, 0, 1, 0]], "sky": (0, 0, 1)})
    assert np.allclose(trisect.Renderer(moved, "cpu").render(1).image, (0, 0, 1), atol=1e-3)
    with pytest.raises(TypeError, match="Mesh of arrays cannot be a value"):
        scene.edit({"objects.box": square()})
    with pytest.raises(ValueError, match="is not the path of a field"):
        scene.edit({"camera.look_at=0,1,0": 1})


@pytest.mark.filterwarnings("ignore:.*nothing in view")
@pytest.mark.parametrize("number", [0.5, 5e-324, 1e-5, 1e16, 1e300, -0.0, 2, float("nan"), float("inf")])
def test_numbers_of_both_writers_are_the_same(number):
    """Python's numbers are written by the module, those of NumPy by its Python code."""

    def edited(value):
        try:
            return small().edit({"camera.look_at": value}).digest
        except trisect.SceneError as error:
            return error.kind

    numpys = np.int64(number) if isinstance(number, int) else np.float64(number)
    assert edited((number, 0.0, 0.0)) == edited((numpys, np.float64(0), np.float64(0)))


def test_chains_of_edits_stay_short():
    scene = small()
    for share in np.linspace(0.1, 0.9, 300):
        scene = scene.edit({"materials.grey.albedo": (share, share, share)})
    assert np.allclose(color(scene), 0.9, atol=1e-3)


def test_names_are_those_of_the_list():
    spheres = trisect.Spheres(np.float32([[5, 5, 5]]), np.float32([1]), "grey")
    scene = small(objects=[square(), trisect.Sphere((0, 0, 0), 1, "grey"), spheres])
    assert sorted(scene.objects) == ["objects[0]", "objects[1]", "objects[2]"]
    odd = 'a "b" \\ c\n\x01 (é'
    assert small(objects=[trisect.Sphere((0, 0, 0), 1, "grey", name=odd)]).objects == [odd]
    with pytest.raises(TypeError, match="names must be str"):
        small(materials={1: trisect.Lambertian((1, 1, 1))}, objects=[])
    with pytest.raises(ValueError, match="objects.0. has the material None"):
        small(objects=[square(material=None)])


def test_errors_name_file_line_and_remedy(tmp_path):
    path = tmp_path / "bad.ron"
    path.write_text("Scene(version: 1,\n  image: (width: 8, heigth: 4))")
    with pytest.raises(trisect.SceneError, match="heigth") as caught:
        trisect.Scene.load(path)
    error = caught.value
    assert (error.kind, error.file, error.line) == ("Invalid", str(path), 2) and error.column > 10
    copy = pickle.loads(pickle.dumps(error))
    assert (type(copy), str(copy), copy.line) == (trisect.SceneError, str(error), 2)
    with pytest.raises(trisect.SceneError) as caught:
        trisect.Scene.load(tmp_path / "missing.ron")
    assert caught.value.kind == "Read" and caught.value.file.endswith("missing.ron")
    with pytest.raises(trisect.SceneError, match="unknown format"):
        trisect.Scene.load(tmp_path / "a.blend")


def test_warnings_are_issued():
    with pytest.warns(trisect.SceneWarning, match="no light"):
        scene = small(sky=None)
    assert any("no light" in text for text in scene.warnings)
    with warnings.catch_warnings():
        warnings.simplefilter("error", trisect.SceneWarning)
        with pytest.raises(trisect.SceneWarning):
            small(sky=None)
