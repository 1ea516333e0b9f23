"""The stubs: mypy accepts the package and a program, and they agree with the compiled part."""

import importlib.util
import pathlib
import subprocess
import sys

import pytest

import trisect

needs_mypy = pytest.mark.skipif(importlib.util.find_spec("mypy") is None, reason="mypy is not installed")

PROGRAM = """
import numpy as np
import trisect
from typing import Any, Optional
class Comm:
    def Dup(self) -> Any: ...
    def Get_rank(self) -> int: return 0
    def Get_size(self) -> int: return 1
scene = trisect.Scene(
    camera=trisect.Camera((0, 0, 4), (0, 0, 0), 40), materials={"a": trisect.Lambertian((1, 0, 0))},
    objects=[trisect.Sphere((0, 0, 0), 1, "a")], sky=(1, 1, 1),
    textures={"a": np.zeros((2, 2, 3), np.uint8), "b": trisect.Texels(np.zeros((2, 2), np.float32), wrap="Clamp")},
)
frame = trisect.Renderer(scene, "cpu").render(4, width=16, aov=["depth"], progress=lambda p: print(p.done))
image: np.ndarray = frame.image
frame.save("a.png", tonemap="agx")
film: trisect.Film = trisect.merge([frame.film, "a.ckpt"]) + trisect.Film.load("b.ckpt")
shared: Optional[trisect.Frame] = trisect.Renderer(scene).render(4, comm=Comm(), sample_range=(0, 4))
found = trisect.tradeoff(scene, knobs=["depth"], spp=[1, 4], seeds=4, progress=lambda p: print(p.stage))
errors = [row["error"] for row in found.table]
found.plot().set_title(found.advice)
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("types")


@pytest.fixture(scope="module")
def stubtest(folder):
    """The check of the stubs, which runs beside mypy's of the package."""
    words = [sys.executable, "-m", "mypy.stubtest", "trisect._trisect", "--ignore-missing-stub"]
    with subprocess.Popen(words, cwd=folder, stdout=subprocess.PIPE, text=True) as process:
        yield process
        process.kill()


@needs_mypy
def test_mypy_accepts_the_package(folder, stubtest):
    def run():
        # NumPy's part is checked once for all runs of this environment.
        cache = pathlib.Path(sys.prefix) / "mypy_cache"
        words = [sys.executable, "-m", "mypy", "--cache-dir", cache, "--strict", "-p", "trisect", "-m", "program"]
        return subprocess.run(words, cwd=folder, capture_output=True, text=True)

    (folder / "program.py").write_text("# mypy: allow-any-generics\n" + PROGRAM)
    found = run()
    assert found.returncode == 0, found.stdout
    # Negative control: a wrong argument is found.
    (folder / "program.py").write_text("# mypy: allow-any-generics\n" + PROGRAM.replace('"agx"', '"pretty"'))
    found = run()
    assert found.returncode == 1 and "program.py" in found.stdout and "pretty" in found.stdout, found.stdout


@needs_mypy
def test_stubs_agree_with_the_module(stubtest):
    out, _ = stubtest.communicate()
    assert stubtest.returncode == 0, out


def test_everything_has_a_docstring():
    for name in trisect.__all__:
        of = getattr(trisect, name)
        if isinstance(of, type) and of.__module__.startswith("trisect"):
            assert of.__doc__ and "(" not in of.__doc__[:1], name
    for of in (trisect.Scene, trisect.Renderer, trisect.Frame, trisect.Film, trisect.Tradeoff, trisect.Convergence):
        for name, member in vars(of).items():
            if not name.startswith("_"):
                assert getattr(member, "__doc__", None), f"{of.__name__}.{name}"
    assert pathlib.Path(trisect.__file__).with_name("py.typed").exists()
