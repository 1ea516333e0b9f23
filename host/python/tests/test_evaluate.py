"""Noise and bias of images of any renderer."""

import numpy as np
import pytest

import trisect


def noisy(truth, sigma, count, random, bias=0.0):
    noise = random.normal(0, sigma, (count, *truth.shape))
    return [(truth + bias + one).astype(np.float32) for one in noise]


@pytest.fixture
def truth():
    return np.random.default_rng(7).uniform(0.5, 2, (18, 24, 3))


def test_intervals_hold_the_bias(truth):
    """Over 100 repetitions, the interval of the squared bias holds 0 where there is none, and the
    bias where there is one."""
    random = np.random.default_rng(3)
    held = {0.0: 0, 0.05: 0}
    for bias in held:
        relative = np.mean(bias**2 / (truth**2 + 0.01))
        for _ in range(100):
            reference = noisy(truth, 0.05, 4, random)
            errors = trisect.evaluate(noisy(truth, 0.2, 6, random, bias), reference)["rows"][0]["errors"]
            interval = errors["squared_bias"]
            held[bias] += interval["low"] <= relative <= interval["high"]
    assert min(held.values()) >= 90, held


def test_configurations_are_rows(truth):
    random = np.random.default_rng(5)
    images = {"few": noisy(truth, 0.4, 4, random), "many": noisy(truth, 0.1, 4, random)}
    seconds = {"few": [1.0] * 4, "many": [16.0] * 4}
    found = trisect.evaluate(images, noisy(truth, 0.02, 4, random), seconds=seconds)
    few, many = found["rows"]
    assert (few["name"], many["name"]) == ("few", "many")
    ratio = few["errors"]["variance"]["value"] / many["errors"]["variance"]["value"]
    assert 12 < ratio < 20 and few["seconds"]["median"] == 1.0
    # Equal efficiency: the variance falls with the time.
    assert 0.7 < few["efficiency"]["value"] / many["efficiency"]["value"] < 1.4


def test_frames_and_files(tmp_path):
    renderer = trisect.Renderer(trisect.Scene.hello_world(), "cpu")
    frames = [renderer.render(4, width=32, seed=seed) for seed in range(3)]
    renderer.render(256, width=32, seed=9).save(tmp_path / "reference.pfm")
    found = trisect.evaluate(frames, tmp_path / "reference.pfm")
    assert found["reference"]["images"] == 1 and found["reference"]["error"] is None
    assert found["rows"][0]["errors"]["variance"]["value"] > 0


def test_bad_images(truth):
    random = np.random.default_rng(1)
    good, reference = noisy(truth, 0.1, 3, random), noisy(truth, 0.1, 2, random)
    for images, kind, text in [
        (good[:1], trisect.LabError, "1 of at least 2 images"),
        ([good[0], good[0]], trisect.LabError, "equal to"),
        ([good[0], good[1][:12].copy()], trisect.LabError, "render both at one size"),
        ([good[0], good[1] * np.float32(np.nan)], trisect.LabError, "NaN or infinite in 432"),
        ([good[0], good[1].astype(np.float64)], TypeError, r"images\[1\] must be"),
        (good[0], TypeError, "must be a sequence of images"),
        ("a.png", TypeError, "must be a sequence of images"),
        (["a.png", "b.png"], trisect.LabError, "an image for a display"),
    ]:
        with pytest.raises(kind, match=text):
            trisect.evaluate(images, reference)
    with pytest.raises(trisect.LabError):
        trisect.evaluate(good, [])
    with pytest.raises(ValueError, match="seconds has 'y'"):
        trisect.evaluate({"x": good}, reference, seconds={"y": [1.0]})
    stacked = trisect.evaluate(np.stack(good), np.stack(reference), seconds=2.0)
    assert stacked["rows"][0]["errors"] == trisect.evaluate(good, reference)["rows"][0]["errors"]


def test_the_spectrum_adds_up(truth):
    random = np.random.default_rng(5)
    row = trisect.evaluate(noisy(truth, 0.2, 8, random), noisy(truth, 0.02, 8, random))["rows"][0]
    parts = sum(band["rel_mse"]["value"] for band in row["spectrum"])
    assert parts == pytest.approx(row["errors"]["rel_mse"]["value"], rel=1e-6)
    assert row["spectrum"][-1]["density"] == pytest.approx(1, abs=0.1)


def test_frames(truth):
    random = np.random.default_rng(6)
    reference = [(truth + 0.01 * frame).astype(np.float32) for frame in range(5)]
    [still] = noisy(truth, 0.1, 1, random)
    sets = {
        "independent": [(one + 0.01 * frame).astype(np.float32) for frame, one in enumerate(noisy(truth, 0.1, 5, random))],
        "still": [(still + 0.01 * frame).astype(np.float32) for frame in range(5)],
    }
    independent, steady = trisect.evaluate(sets, reference, frames=True)["rows"]
    assert independent["flicker_ratio"] == pytest.approx(1, abs=0.1)
    assert steady["flicker_ratio"] < 1e-3
    assert len(steady["flicker_each"]) == 4
    with pytest.raises(trisect.LabError, match="5 frames, but the reference has 4"):
        trisect.evaluate(sets, reference[:4], frames=True)
