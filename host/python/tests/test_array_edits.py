"""Edits of objects and skies that are arrays."""

import numpy as np
import pytest

import trisect
from test_scenes import color, small, square

CENTERS, RADII = np.float32([[0, 0, 0], [2, 0, 0]]), np.float32([1, 0.5])
TURN = np.array([[0, -1, 0, 0.5], [1, 0, 0, 0], [0, 0, 1, 1], [0, 0, 0, 1]])


def balls(**fields):
    return trisect.Spheres(**{"centers": CENTERS, "radii": RADII, "material": "red", "name": "balls", **fields})


def image(scene):
    return trisect.Renderer(scene, "cpu").render().image


def test_meshes_move():
    for name in ["window", None]:
        scene = small(objects=[square(name=name)])
        moved = scene.edit({f"objects.{name or 0}.transform": TURN})
        assert moved.digest == small(objects=[square(transform=TURN, name=name)]).digest != scene.digest
        assert moved.objects == scene.objects
    by_steps = scene.edit({"objects.0.transform": "[RotateZ(90), Translate((0.5, 0, 1))]"})
    assert by_steps.digest == moved.digest
    assert scene.edit({"objects.0.transform": None}).digest == scene.digest


def test_arrays_are_replaced():
    scene = small(objects=[square(name="window"), balls()])
    positions, centers = scene_positions() * np.float32(0.5), CENTERS + np.float32(1)
    edited = scene.edit({"objects.window.positions": positions, "objects.balls.centers": centers})
    expected = small(objects=[trisect.Mesh(positions, [[0, 1, 2], [0, 2, 3]], "red", name="window"), balls(centers=centers)])
    assert edited.digest == expected.digest != scene.digest
    # Together, arrays may have other sizes.
    fewer = scene.edit({"objects.balls.centers": CENTERS[:1], "objects.balls.radii": RADII[:1]})
    assert fewer.digest == small(objects=[square(name="window"), balls(centers=CENTERS[:1], radii=RADII[:1])]).digest
    assert fewer.objects == ["balls", "window"] and scene.objects == ["balls", "balls", "window"]
    whole = scene.edit({"objects.window": trisect.Spheres(CENTERS, RADII, "grey")})
    assert whole.objects == ["window", "window", "balls", "balls"]


def scene_positions():
    return np.asarray(square().positions)


def test_materials_and_names_change():
    scene = small(objects=[square(name="window"), trisect.Spheres(CENTERS + np.float32([5, 5, 0]), RADII, "grey", name="balls")])
    grey = scene.edit({"objects.window.material": "grey"})
    assert np.allclose(color(scene), (0.8, 0.1, 0.1), atol=1e-3) and np.allclose(color(grey), 0.5, atol=1e-3)
    renamed = grey.edit({"objects.window.name": "door"})
    assert renamed.objects == ["balls", "balls", "door"]
    assert renamed.edit({"objects.door.material": "red"}).digest == scene.digest
    # New materials do not move those that exist.
    blue = scene.edit({"materials.blue": trisect.Lambertian((0, 0, 1))})
    assert np.allclose(color(blue), (0.8, 0.1, 0.1), atol=1e-3)
    assert np.allclose(color(blue.edit({"objects.window.material": "blue"})), (0, 0, 1), atol=1e-3)


def test_numbers_are_places_in_the_list():
    ball = trisect.Sphere((0, 0, 0), 1, "grey", name="ball")
    scene = small(objects=[square(), ball, balls()])
    assert scene.edit({"objects.1.material": "red"}).digest == scene.edit({"objects.ball.material": "red"}).digest
    assert scene.edit({"objects[2].material": "grey"}).digest == scene.edit({"objects.balls.material": "grey"}).digest
    assert scene.edit({"objects.0.material": "grey"}).digest not in {
        scene.digest,
        scene.edit({"objects.1.material": "red"}).digest,
        scene.edit({"objects.2.material": "grey"}).digest,
    }


def test_chains_of_edits_keep_each_other():
    scene = small(objects=[square(name="window"), balls()])
    for x in np.linspace(0, 1, 50):
        scene = scene.edit({"objects.window.transform": np.eye(4) * (1, 1, 1, 1) + [[0, 0, 0, x], [0] * 4, [0] * 4, [0] * 4]})
        scene = scene.edit({"materials.red.albedo": (x, x, x)})
    moved = [[1, 0, 0, 1], [0, 1, 0, 0], [0, 0, 1, 0]]
    materials = {"grey": trisect.Lambertian((0.5, 0.5, 0.5)), "red": trisect.Lambertian((1, 1, 1))}
    assert scene.digest == small(objects=[square(name="window", transform=moved), balls()], materials=materials).digest


def test_scenes_of_files_take_arrays(tmp_path):
    path = tmp_path / "a.ron"
    path.write_text(
        "Scene(version: 1, image: (width: 32, height: 32), sky: Uniform(radiance: (1, 1, 1)),"
        " camera: (look_from: (0, 0, 4), look_at: (0, 0, 0), vertical_fov: 40), textures: { \"wood\": (file: \"no.png\") },"
        " materials: { \"red\": Lambertian(albedo: (1, 1, 1), texture: \"wood\") },"
        " objects: [Sphere(center: (0, 0, 0), radius: 1, material: \"red\")])"
    )
    blue, sky = np.float32([[[0, 0, 1]]]), np.full((4, 8, 3), 0.25, np.float32)
    scene = trisect.Scene.load(path, set={"textures.wood": blue, "sky": sky})
    assert np.allclose(color(scene), (0, 0, 1), atol=1e-3) and np.allclose(image(scene)[0, 0], 0.25, atol=1e-3)
    assert np.allclose(color(scene.edit({"textures.wood": blue[..., ::-1].copy()})), (1, 0, 0), atol=1e-3)
    # Negative control: without the array the file is missing.
    with pytest.raises(trisect.SceneError, match="no.png"):
        trisect.Scene.load(path, set={"sky": sky})


def test_skies_of_arrays():
    day, night = np.ones((4, 8, 3), np.float32), np.full((4, 8, 3), 0.25, np.float32)
    scene = small(objects=[], sky=day)
    for edited, expected in [
        (scene.edit({"sky": night}), night),
        (scene.edit({"sky.radiance": night}), night),
        (scene.edit({"sky.scale": 0.25}), trisect.Panorama(day, scale=0.25)),
        (scene.edit({"sky": trisect.Panorama(night, rotation=90)}), trisect.Panorama(night, rotation=90)),
        (scene.edit({"sky": (0, 0, 1)}), (0, 0, 1)),
        (scene.edit({"sky": (0, 0, 1)}).edit({"sky": day}), day),
        (small(objects=[]).edit({"sky": day}), day),
    ]:
        assert edited.digest == small(objects=[], sky=expected).digest
    with pytest.raises(trisect.SceneError, match="sky has no color; it has radiance, scale, rotation"):
        scene.edit({"sky.color": (1, 1, 1)})
    with pytest.raises(ValueError, match="sky.radiance has -1 as its value 0"):
        scene.edit({"sky.radiance": -day})


@pytest.mark.parametrize(
    "changes, kind, text",
    [
        ({"objects.bals.centers": CENTERS}, trisect.SceneError, "objects.bals.centers: this field takes no array; objects of arrays are window, balls"),
        ({"objects.bals.material": "red"}, trisect.SceneError, "objects has no bals; its entries are 0 to 0, named ball; objects of arrays are window, balls"),
        ({"objects.7.material": "red"}, trisect.SceneError, "objects has no 7"),
        ({"objects.balls.center": (0, 0, 0)}, trisect.SceneError, "objects.balls has no center; it has centers, radii, material, name"),
        ({"objects.window.radii": RADII}, trisect.SceneError, "objects.window has no radii; it has positions, triangles, normals"),
        ({"objects.window.positions.0": 1}, trisect.SceneError, "objects.window.positions has no fields"),
        ({"objects.window.material": "blue"}, trisect.SceneError, "objects.window.material: unknown material .blue.; `materials` has: grey, red"),
        ({"objects.ball.center": CENTERS}, trisect.SceneError, "objects.ball.center: this field takes no array"),
        ({"objects.window.transform": "[Spin(3)]"}, trisect.SceneError, "objects.window.transform is .*Spin"),
        ({"objects.window.transform": np.zeros((4, 4)) + [[0], [0], [0], [1]] * np.eye(4)}, trisect.SceneError, "flattens"),
        ({"objects.window.transform": np.eye(3)}, ValueError, "transform has shape"),
        ({"objects.window.material": 3}, TypeError, "objects.window.material must be a str, not int"),
        ({"objects.window.name": None}, TypeError, "objects.window.name must be a str"),
        ({"objects.window": trisect.Sphere((0, 0, 0), 1, "red")}, TypeError, "objects.window is an object of arrays; it must be a Mesh or Spheres, not Sphere"),
        ({"objects.balls.centers": CENTERS.astype(np.float64)}, TypeError, "objects.balls.centers must be a float32 array of shape .n, 3., not an array of float64"),
        ({"objects.balls.centers": None}, TypeError, "objects.balls.centers must be a float32 array"),
        ({"objects.balls.centers": "many"}, TypeError, "objects.balls.centers must be .*, not str"),
        ({"objects.balls.centers": CENTERS[:1]}, ValueError, "objects.balls.radii has 2 values, and centers has 1 rows"),
        ({"objects.balls.centers": CENTERS * np.float32("nan")}, ValueError, "objects.balls.centers has NaN as its value 0"),
        ({"objects.balls.centers": CENTERS[:, ::-1]}, ValueError, "objects.balls.centers is not contiguous"),
        ({"objects.balls.radii": -RADII}, ValueError, "objects.balls.radii has -1 as its value 0"),
        ({"objects.window.positions": CENTERS}, ValueError, "objects.window.triangles has the index 2, and positions has 2 vertices"),
        ({"objects.window.normals": CENTERS}, ValueError, "objects.window.normals has 2 rows, and positions has 4"),
        ({"objects.window.triangles": [[0, 1, -1]]}, ValueError, "triangles must be whole numbers"),
    ],
)
def test_wrong_edits_are_named(changes, kind, text):
    ball = trisect.Sphere((0, 0, 0), 1, "grey", name="ball")
    scene = small(objects=[square(name="window"), ball, balls()])
    digest = scene.digest
    with pytest.raises(kind, match=text):
        scene.edit(changes)
    assert scene.digest == digest and scene.edit({}).digest == digest


def test_a_mesh_that_moves_keeps_what_is_the_same():
    scene = small(objects=[square(name="window"), balls(centers=CENTERS + np.float32([0, 3, 0]))])
    renderer = trisect.Renderer(scene, "cpu")
    renderer.render()
    moved = scene.edit({"objects.window.transform": [[1, 0, 0, 0.25], [0, 1, 0, 0], [0, 0, 1, 0]]})
    told = renderer.update(moved)
    assert told["tree"] == "refitted" and not {"spheres", "materials", "texels"} & set(told["written"])
    assert np.array_equal(renderer.render().image, image(moved)) and not np.array_equal(image(moved), image(scene))
    told = renderer.update(moved.edit({"materials.red.albedo": (0.1, 0.1, 0.9)}))
    assert told["tree"] == "kept" and set(told["written"]) == {"materials"}
