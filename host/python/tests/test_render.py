"""Renders: the program's bits, goals, layers, files."""

import os
import subprocess
import sys
import types

import numpy as np
import pytest

import trisect


@pytest.fixture(scope="module")
def renderer():
    return trisect.Renderer(trisect.Scene.hello_world(), "cpu")


def test_ten_lines_render_the_book(root, program, tmp_path):
    scene = trisect.Scene.load(root / "scenes" / "rtiow_final.ron")
    frame = trisect.Renderer(scene, "cpu").render(spp=3, width=64, height=36, seed=5)
    out = tmp_path / "a.pfm"
    command = [program, "render", str(root / "scenes" / "rtiow_final.ron"), "-o", str(out), "-q"]
    subprocess.run(command + "--backend cpu --spp 3 --resolution 64x36 --seed 5".split(), check=True)
    expected = trisect.read_image(out)
    assert frame.image.shape == (36, 64, 3) and frame.image.dtype == np.float32
    assert np.array_equal(frame.image.view(np.uint32), expected.view(np.uint32))
    assert np.array_equal(frame.film.mean, frame.image)
    # Negative control: another seed has other bits.
    other = trisect.Renderer(scene, "cpu").render(spp=3, width=64, height=36, seed=6)
    assert not np.array_equal(other.image, expected)


def test_films_add_up_to_the_same_bits(renderer):
    frame = renderer.render(4, width=16)
    assert (frame.film.samples == 4).all() and frame.film.rejected == 0
    assert frame.film.variance.shape == (9, 16, 3) and (frame.film.variance >= 0).all()
    assert frame.complete and frame.stats["samples"] == 4 * 16 * 9
    with pytest.raises(trisect.FilmError, match="in both films"):
        frame.film + frame.film
    assert np.isinf(renderer.render(1, width=16).film.variance).all()


def test_sizes_follow_the_aspect(renderer):
    assert renderer.render(1, width=32).image.shape == (18, 32, 3)
    assert renderer.render(1, height=9).image.shape == (9, 16, 3)
    assert renderer.render(1, width=32, height=32).image.shape == (32, 32, 3)
    assert renderer.render(1, width=32, height=32, crop=(0.5, 0, 1, 0.25)).image.shape == (8, 16, 3)
    assert renderer.render(1, width=32, height=32, crop=(3, 4, 10, 6)).image.shape == (2, 7, 3)


def test_goals(renderer):
    timed = renderer.render(budget="300ms", width=32)
    assert timed.complete and timed.stats["sampling"]["goal"] == "time"
    told = []
    exact = renderer.render(target_error="20%", width=32, progress=told.append)
    assert exact.stats["sampling"]["noise"]["error"] <= 0.2
    assert all(one.total is None for one in told)
    with pytest.raises(trisect.SettingsError, match="spp and budget cannot be combined"):
        renderer.render(4, budget=1)


@pytest.mark.parametrize("name", ["atrous", "svgf"])
def test_denoised_images(renderer, name):
    frame = renderer.render(4, width=32, denoise=name)
    assert not np.array_equal(frame.image, frame.film.mean)
    assert frame.stats["denoise"]["filter"] == name


def test_layers(renderer):
    names = ["normal", "geometric-normal", "position", "albedo", "depth", "id", "variance", "samples", "uv"]
    aovs = renderer.render(4, width=32, aov=names + ["cryptomatte"]).aovs
    shapes = {name: aovs[name].shape for name in names}
    three, one = (18, 32, 3), (18, 32)
    assert shapes == {
        "normal": three, "geometric-normal": three, "position": three, "albedo": three, "depth": one,
        "id": one, "variance": three, "samples": one, "uv": (18, 32, 2),
    }
    assert aovs["id"].dtype == np.uint32 and aovs["depth"].dtype == np.float32
    hit = np.isfinite(aovs["depth"]) & (np.abs(np.linalg.norm(aovs["normal"], axis=2) - 1) < 1e-3)
    assert hit.sum() > 100
    assert aovs["cryptomatte"].shape == (18, 32, 24)
    assert renderer.render(1, width=8, aov="depth").aovs.keys() == {"depth"}
    assert renderer.render(1, width=8).aovs == {}


def test_transparent_images(renderer):
    frame = renderer.render(4, width=32, transparent=True)
    assert frame.alpha.shape == (18, 32) and 0 <= frame.alpha.min() < frame.alpha.max() <= 1
    assert (frame.image[frame.alpha == 0] == 0).all()
    assert renderer.render(1, width=8).alpha is None


@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.tif", "a.exr", "a.hdr", "a.pfm"])
def test_files_are_read_back(renderer, tmp_path, name):
    frame = renderer.render(8, width=32, aov=["depth"])
    path = tmp_path / name
    frame.save(path, **({"full": True} if name.endswith("exr") else {}))
    image = trisect.read_image(path)
    error = np.abs(image - np.clip(frame.image, 0, 1) if name[2:] in ("png", "jpg", "tif") else image - frame.image)
    limit = {"png": 0.01, "jpg": 0.3, "tif": 0.01, "exr": 0, "hdr": 0.02, "pfm": 0}[name[2:]]
    assert error.max() <= limit


def test_pictures_for_notebooks(renderer):
    assert renderer.render(1, width=8)._repr_png_().startswith(b"\x89PNG")


def test_the_progress_is_told():
    told = []
    # One thread, so that the render takes several times the interval of progress on any processor.
    trisect.Renderer(trisect.Scene.hello_world(), "cpu", threads=1).render(400, width=96, progress=told.append)
    assert told and all(one.total == 400 * 96 * 54 for one in told)
    assert all(a.done <= b.done for a, b in zip(told, told[1:])) and told[0].left > 0


def test_an_exception_of_the_callback_ends_the_render(renderer):
    def stop(progress):
        raise ZeroDivisionError(progress.done)

    with pytest.raises(ZeroDivisionError):
        renderer.render(10_000_000, width=96, progress=stop)
    # The renderer is as it was.
    assert np.array_equal(renderer.render(2, width=16).image, renderer.render(2, width=16).image)


def test_the_callback_cannot_use_the_renderer(renderer):
    with pytest.raises(trisect.BusyError, match="cannot use it"):
        renderer.render(10_000_000, width=96, progress=lambda _: renderer.render(1))


def test_the_callback_reads_the_scene(renderer):
    told = []
    renderer.render(400, width=96, progress=lambda _: told.append(renderer.scene.name))
    assert set(told) == {renderer.scene.name}


class CountedBar:
    """Stands in for tqdm's bar."""

    opened = closed = 0

    def __init__(self, **options):
        CountedBar.opened += 1
        self.n = 0

    def update(self, more):
        self.n += more

    def set_postfix(self, **values):
        pass

    def set_postfix_str(self, text, refresh):
        pass

    def write(self, text, file):
        pass

    def refresh(self):
        pass

    def close(self):
        CountedBar.closed += 1


@pytest.fixture
def counted(monkeypatch):
    tqdm = types.ModuleType("tqdm")
    tqdm.auto = types.SimpleNamespace(tqdm=CountedBar)
    monkeypatch.setitem(sys.modules, "tqdm", tqdm)
    monkeypatch.setitem(sys.modules, "tqdm.auto", tqdm.auto)
    monkeypatch.setattr(CountedBar, "opened", 0)
    monkeypatch.setattr(CountedBar, "closed", 0)


@pytest.mark.parametrize("goal", [{"spp": 400}, {"target_error": "0.3%"}, {"budget": "300ms"}])
def test_bars_are_closed(counted, renderer, goal):
    renderer.render(**goal, width=96, progress=True)
    assert (CountedBar.opened, CountedBar.closed) == (1, 1)


def test_bars_of_measurements_are_closed(counted, tmp_path):
    scene = trisect.Scene.hello_world()
    size = dict(width=16, height=16, seeds=4, reference_spp=4, backend="cpu", cache=tmp_path)
    trisect.tradeoff(scene, knobs="sampler", spp=[1], **size, progress=True)
    assert (CountedBar.opened, CountedBar.closed) == (1, 1)


def test_a_callable_of_the_caller_is_not_closed(counted, renderer):
    """Negative control: only the module's own bars are closed."""
    from tqdm.auto import tqdm

    class Own(tqdm):
        def __call__(self, progress):
            self.update(1)

    renderer.render(400, width=96, progress=Own())
    assert (CountedBar.opened, CountedBar.closed) == (1, 0)


def test_a_line_of_progress_is_ended(monkeypatch, capfd, renderer):
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    renderer.render(target_error="0.3%", width=96, progress=True)
    assert "error" in (shown := capfd.readouterr().err) and shown.endswith("\n"), shown


def test_comparisons(renderer, tmp_path):
    a, b = renderer.render(2, width=64), renderer.render(64, width=64, seed=1)
    b.save(tmp_path / "b.pfm")
    results = [trisect.compare(a, b), trisect.compare(a.image, b.image), trisect.compare(a, tmp_path / "b.pfm")]
    assert results[0] == results[1] == results[2]
    assert results[0]["rmse"] > 0 and trisect.compare(a, a)["rmse"] == 0
    by_hand = np.sqrt(np.mean((a.image.astype(np.float64) - b.image) ** 2))
    assert abs(results[0]["rmse"] - by_hand) < 1e-9
    assert trisect.compare(a, b, flip_map=True)["flip_map"].shape == (36, 64)
    with pytest.raises(trisect.MetricsError):
        trisect.compare(a, renderer.render(1, width=32))


def test_devices_are_listed():
    backends = {entry["backend"]: entry for entry in trisect.devices()}
    assert set(backends) == {"cpu", "cuda", "wgpu"} and backends["cpu"]["devices"]
    for entry in backends.values():
        assert entry["devices"] or entry["error"]


@pytest.mark.parametrize("backend", ["wgpu", "cuda"])
def test_backends_agree_or_say_why(backend):
    scene = trisect.Scene.hello_world()
    try:
        renderer = trisect.Renderer(scene, backend, device=0)
    except trisect.UnavailableError as error:
        assert error.place == backend and error.remedy
        assert backend not in os.environ.get("REQUIRE_BACKENDS", "").split(","), error
        pytest.skip(str(error))
    image = renderer.render(16, width=32).image
    expected = trisect.Renderer(scene, "cpu").render(16, width=32).image
    if backend == "cuda":
        assert np.array_equal(image, expected)
    else:
        # Vulkan's drivers may round otherwise: paths of a few pixels differ.
        assert np.median(np.abs(image - expected)) < 1e-5
