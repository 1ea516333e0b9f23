"""Checkpoints: interrupted renders continue to the same bits, parts add up, faults are named."""

import os
import subprocess

import numpy as np
import pytest

import trisect
from test_scenes import small

#: Samples of 16 chunks, which are as many parts of the render: on one thread they take longer than
#: the time between two calls of the callback.
SPP = 4096
PART = 256 * 32 * 18


@pytest.fixture(scope="module")
def renderer():
    return trisect.Renderer(trisect.Scene.hello_world(), "cpu", threads=1)


def render(renderer, spp=SPP, **keywords):
    return renderer.render(spp, width=32, depth=2, **keywords)


def ending(kind, after):
    """A callback that ends the render with an exception once it has so many parts."""

    def told(progress):
        if progress.done >= after * PART:
            raise kind("enough")

    return told


def test_an_interrupted_render_continues_to_the_same_bits(renderer, tmp_path):
    path = tmp_path / "film.ckpt"
    with pytest.raises(ZeroDivisionError):
        render(renderer, checkpoint=path, progress=ending(ZeroDivisionError, 2))
    first = trisect.Film.load(path).samples
    assert 256 <= first.min() and first.max() < SPP
    with pytest.raises(trisect.RenderInterrupted) as interrupt:
        render(renderer, checkpoint=path, resume=True, progress=ending(KeyboardInterrupt, 1))
    partial = interrupt.value.frame
    assert not partial.complete and partial.film == trisect.Film.load(path)
    assert (partial.film.samples >= first).all()
    frame = render(renderer, checkpoint=str(path), resume=True, checkpoint_every="1ms")
    whole = render(renderer)
    assert frame.complete and frame.film == whole.film == trisect.Film.load(path)
    assert np.array_equal(frame.image, whole.image)
    # A complete file is read, and nothing is rendered.
    again = render(renderer, checkpoint=path, resume=True)
    assert again.film == whole.film and again.stats["rendered_samples"] == 0
    # Negative control: another seed has other bits, and its file is another image.
    assert render(renderer, seed=1).film != whole.film
    with pytest.raises(trisect.CheckpointError, match="seed is 0 in this file, but 1 here") as error:
        render(renderer, checkpoint=path, resume=True, seed=1)
    assert (error.value.kind, error.value.place, error.value.file) == ("Differs", "seed", str(path))


def test_a_cancelled_render_continues_with_layers_and_a_denoiser(renderer, tmp_path):
    path = tmp_path / "film.ckpt"
    asked = dict(spp=1024, denoise="atrous", aov=["normal"])

    def cancel(progress):
        if progress.done >= 2 * PART:
            renderer.cancel()

    try:
        render(renderer, checkpoint=path, progress=cancel, **asked)
    except trisect.CancelledError:
        pass  # a fast device may have ended before
    frame, whole = render(renderer, checkpoint=path, resume=True, **asked), render(renderer, **asked)
    assert frame.film == whole.film and np.array_equal(frame.image, whole.image)
    assert np.array_equal(frame.aovs["normal"], whole.aovs["normal"])
    with pytest.raises(trisect.CheckpointError, match="guides is true"):
        render(renderer, 1024, checkpoint=path, resume=True)


def test_parts_add_up(renderer, tmp_path):
    parts = [render(renderer, 600, sample_range=ends).film for ends in [(0, 256), (256, 512), (512, 600)]]
    whole = render(renderer, 600).film
    paths = [tmp_path / f"{index}.ckpt" for index in range(3)]
    for path, part in zip(paths, parts):
        part.save(path)
    assert parts[2] + parts[0] + parts[1] == whole == trisect.merge(paths)
    merged = trisect.merge([str(paths[1]), parts[2]])
    assert merged != whole and (merged.samples == 344).all()
    merged.save(tmp_path / "sum.ckpt")
    assert render(renderer, 600, checkpoint=tmp_path / "sum.ckpt", resume=True).film == whole
    # Each fault is named, and the sum stays as it was.
    other = render(renderer, 600, sample_range=(0, 256), seed=1).film
    with pytest.raises(trisect.FilmError, match="seed is 0 in one film, but 1 in the other"):
        parts[1] + other
    with pytest.raises(trisect.CheckpointError, match=r"films\[1\]: seed is 1 in this file, but 0 here"):
        trisect.merge([parts[1], other])
    with pytest.raises(trisect.CheckpointError, match=r"0\.ckpt: samples 0 to 256 of row 0 are in both") as error:
        trisect.merge([parts[0], paths[1], paths[0]])
    assert error.value.file == str(paths[0]) and error.value.kind == "Film"
    assert trisect.merge(parts) == whole


def test_the_program_reads_the_files(root, program, tmp_path):
    scene = root / "scenes" / "three_spheres.ron"
    renderer = trisect.Renderer(trisect.Scene.load(scene), "cpu")
    asked = dict(spp=512, width=32, height=18)
    whole = renderer.render(**asked)
    ours, theirs = tmp_path / "ours.ckpt", tmp_path / "theirs.ckpt"
    renderer.render(**asked, sample_range=(256, 512), checkpoint=ours)

    def run(*words, code=0):
        done = subprocess.run([program, *map(str, words)], cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == code, done.stderr
        return done.stderr

    run("render", scene, *"--backend cpu --spp 512 --resolution 32x18 --sample-range 0..256".split(),
        "--checkpoint", theirs, "-o", "part.pfm")
    assert trisect.merge([ours, theirs]) == whole.film
    run("merge", theirs, ours, "-o", "sum.pfm")
    assert np.array_equal(trisect.read_image(tmp_path / "sum.pfm"), whole.image)
    # The program has no command to resume of a film that Python began.
    assert "no command to resume" in run("resume", ours, "-o", "a.png", code=1)
    # Python continues the program's, which the program then still resumes.
    frame = renderer.render(**asked, checkpoint=theirs, resume=True)
    assert frame.film == whole.film
    run("resume", theirs, "-o", "all.pfm")
    assert np.array_equal(trisect.read_image(tmp_path / "all.pfm"), whole.image)


def test_bad_files_are_named_and_stay(renderer, tmp_path):
    path = tmp_path / "film.ckpt"
    render(renderer, 4, checkpoint=path)
    good = path.read_bytes()
    calls = [
        trisect.Film.load,
        lambda path: trisect.merge([path]),
        lambda path: render(renderer, 4, checkpoint=path, resume=True),
    ]
    for bad, text in [(good[:-9], "truncated"), (good[:3000] + b"\x00\xff" + good[3002:], "checksum"), (b"(", "header")]:
        path.write_bytes(bad)
        for call in calls:
            with pytest.raises(trisect.CheckpointError, match=text) as error:
                call(path)
            assert error.value.file == str(path) and path.read_bytes() == bad
    path.write_bytes(good)
    with pytest.raises(trisect.CheckpointError, match="already exists; continue it .resume=True.") as error:
        render(renderer, 4, checkpoint=path)
    assert error.value.kind == "Exists"
    other = trisect.Renderer(small(), "cpu")
    for call, text in [
        (lambda: render(other, 4, height=18, checkpoint=path, resume=True), "scene is"),
        (lambda: render(renderer, 8, checkpoint=path, resume=True), "spp is 4 in this file, but 8 here"),
        (lambda: trisect.Film.load(tmp_path / "none"), "none"),
        (lambda: trisect.merge([path, tmp_path / "none"]), "none"),
        (lambda: render(renderer, 4, checkpoint=tmp_path / "no" / "a.ckpt"), "a.ckpt: "),
        (lambda: render(renderer, 4, checkpoint=tmp_path, resume=True), str(tmp_path)),
        (lambda: trisect.Film.load(path).save(tmp_path / "no" / "a.ckpt"), "a.ckpt: "),
    ]:
        with pytest.raises(trisect.CheckpointError, match=text) as error:
            call()
        assert error.value.file and error.value.frame is None
    assert path.read_bytes() == good and sorted(os.listdir(tmp_path)) == ["film.ckpt"]


@pytest.mark.parametrize(
    "arguments, kind, text",
    [
        ({"checkpoint": 3}, TypeError, "checkpoint must be the path"),
        ({"checkpoint_every": "30s"}, trisect.SettingsError, "checkpoint_every has no effect without checkpoint"),
        ({"checkpoint": "a", "checkpoint_every": "often"}, trisect.SettingsError, "1024spp"),
        ({"checkpoint": "a", "checkpoint_every": -1}, trisect.SettingsError, "checkpoint_every is -1"),
        ({"resume": True}, trisect.SettingsError, "resume has no effect without checkpoint"),
        ({"checkpoint": "a", "resume": "a"}, trisect.SettingsError, "resume is 'a'"),
        ({"sample_range": (0, 0)}, trisect.SettingsError, "first, end"),
        ({"sample_range": 256}, trisect.SettingsError, "sample_range is 256"),
        ({"sample_range": (True, 256)}, trisect.SettingsError, "sample_range is"),
        ({"sample_range": (100, 300)}, trisect.SettingsError, "split a chunk"),
        ({"sample_range": (0, 4096)}, trisect.SettingsError, "4096"),
    ],
)
def test_bad_arguments(renderer, arguments, kind, text):
    with pytest.raises(kind, match=text):
        renderer.render(512, width=16, **arguments)


def test_goals_have_no_checkpoints(renderer, tmp_path):
    for asked in [{"budget": 0.01}, {"target_error": 0.5}]:
        for name, value in [("checkpoint", tmp_path / "a.ckpt"), ("sample_range", (0, 256))]:
            with pytest.raises(trisect.SettingsError, match=f"{name} and {list(asked)[0]} cannot be combined"):
                renderer.render(width=16, **{name: value}, **asked)
    film = renderer.render(target_error=0.5, width=16).film
    for call in [lambda: film.save(tmp_path / "a.ckpt"), lambda: trisect.merge([film])]:
        with pytest.raises(trisect.CheckpointError, match="has no checkpoint"):
            call()
    assert os.listdir(tmp_path) == []


def test_what_is_merged(renderer):
    film = render(renderer, 1).film
    for films in ["a.ckpt", 3, [3], [film, None]]:
        with pytest.raises(TypeError, match="films must be a sequence"):
            trisect.merge(films)
    with pytest.raises(ValueError, match="at least one"):
        trisect.merge([])
    assert trisect.merge(iter([film])) == film


def test_nothing_is_lost_when_the_folder_disappears(renderer, tmp_path, recwarn):
    folder = tmp_path / "folder"
    folder.mkdir()

    def removes_at_the_end(progress):
        if progress.done == progress.total:
            folder.rename(tmp_path / "moved")

    with pytest.raises(trisect.CheckpointError, match="film.ckpt") as error:
        render(renderer, 4, checkpoint=folder / "film.ckpt", progress=removes_at_the_end)
    frame = error.value.frame
    assert frame.complete and frame.film == render(renderer, 4).film
    frame.film.save(tmp_path / "film.ckpt")
    assert render(renderer, 4, checkpoint=tmp_path / "film.ckpt", resume=True).film == frame.film

    def removes_at_once(progress):
        if folder.exists():
            folder.rename(tmp_path / "moved again")
        if recwarn.list:
            raise KeyboardInterrupt

    folder.mkdir()
    with pytest.raises(trisect.RenderInterrupted) as error:
        render(renderer, 10_000_000, checkpoint=folder / "film.ckpt", checkpoint_every="1spp", progress=removes_at_once)
    assert isinstance(error.value.__cause__, trisect.CheckpointError)
    assert error.value.frame.film.samples.min() >= 256
    warning = recwarn.pop(RuntimeWarning)
    assert "film.ckpt" in str(warning.message) and "next checkpoint tries again" in str(warning.message)
