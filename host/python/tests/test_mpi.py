"""Renders over the ranks of mpi4py: the bits of one process, and errors that leave no rank waiting."""

import os
import re
import shutil
import subprocess
import sys

import pytest

import trisect

BEGIN = """
import sys
from mpi4py import MPI
import trisect

comm = MPI.COMM_WORLD
renderer = trisect.Renderer(trisect.Scene.hello_world(), "cpu", threads=1)

def tell(*words):
    for line in comm.gather(" ".join(map(str, words))) or []:
        print(line, flush=True)
"""


def missing():
    """Reason for which no ranks can be started, or None."""
    if shutil.which("mpirun") is None:
        return "mpirun was not found"
    found = subprocess.run([sys.executable, "-c", "from mpi4py import MPI"], capture_output=True, text=True)
    return None if found.returncode == 0 else "mpi4py does not run: " + found.stderr.strip().split("\n")[-1]


@pytest.fixture(scope="module")
def ranks(tmp_path_factory):
    """Runs code on two ranks, and returns what they print."""
    reason = missing()
    if reason:
        assert "mpi" not in os.environ.get("REQUIRE_BACKENDS", "").split(","), reason
        pytest.skip(reason)

    def run(code):
        folder = tmp_path_factory.mktemp("ranks")
        (folder / "script.py").write_text(code)
        options = ["--allow-run-as-root", "--oversubscribe", "--bind-to", "none", "-n", "2"]
        done = subprocess.run(
            ["mpirun", *options, sys.executable, "script.py"], cwd=folder, capture_output=True, text=True, timeout=120
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


def test_ranks_have_the_bits_of_one_process(ranks):
    asked = [
        "spp=300, width=32",
        "spp=512, width=24, sample_range=(256, 512), seed=3",
        "spp=8, width=40, denoise='atrous', aov=['normal', 'uv']",
        "spp=2, width=5, height=1",
    ]
    code = BEGIN
    for arguments in asked:
        code += f"""
frame = renderer.render({arguments}, comm=comm)
if comm.rank == 0:
    one = renderer.render({arguments})
    same = frame.film == one.film and (frame.image == one.image).all() and frame.complete
    same = same and all((frame.aovs[name] == one.aovs[name]).all() for name in one.aovs)
    tell(same, frame.stats["samples"] == one.stats["samples"])
else:
    tell(frame)
"""
    # A communicator of one rank, and another seed as the negative control.
    code += """
alone = renderer.render(8, width=16, comm=MPI.COMM_SELF)
tell(alone.film == renderer.render(8, width=16).film, alone.film == renderer.render(8, width=16, seed=1).film)
"""
    assert ranks(code) == "True True\nNone\n" * len(asked) + "True False\n" * 2


def test_an_error_on_one_rank_ends_all(ranks):
    calls = [
        "spp=4 * (1 - comm.rank)",
        "spp=4, seed=comm.rank",
        "spp=512, sample_range=(256 * comm.rank, 512)",
        "spp=4, progress=fail if comm.rank == 1 else None",
        "spp=4, sample_range=(0, 512)",
        "spp=4, checkpoint='a.ckpt'",
    ]
    code = BEGIN + "def fail(progress): raise ZeroDivisionError('one rank fails')\n"
    for arguments in calls:
        code += f"""
try:
    renderer.render({arguments}, width=16, comm=comm)
except Exception as error:
    tell(type(error).__name__, getattr(error, "place", None), "|", error)
"""
    code += "tell(renderer.render(4, width=16, comm=comm))\n"
    lines = ranks(code).split("\n")
    bad, seeds, parts, failed, beyond, both, after = [lines[index : index + 2] for index in range(0, 14, 2)]
    assert bad[0].startswith("RankError rank 1 | rank 1: spp is 0") and bad[1].startswith("SettingsError spp | spp is 0")
    assert seeds == ["RankError rank 1 | rank 1: seed is 1 there, but 0 on rank 0"] * 2
    assert parts == ["RankError rank 1 | rank 1: sample_range is 256..512 there, but 0..512 on rank 0"] * 2
    assert failed == ["RankError rank 1 | rank 1: one rank fails", "ZeroDivisionError None | one rank fails"]
    assert all("SettingsError" in line for line in beyond)
    assert both == ["SettingsError checkpoint | checkpoint and comm cannot be combined; save the film of rank 0 by Film.save"] * 2
    assert after == ["<Frame: 16x9>", "None"]


def test_the_example_runs(ranks, root):
    text = (root / "docs" / "reference" / "python.md").read_text()
    [(code, printed)] = re.findall(r"```python ranks\n(.*?)```.*?\$ mpirun[^\n]*\n(.*?)```", text, re.DOTALL)
    assert ranks(code) == printed


def test_without_mpi4py_the_error_has_a_remedy(python):
    code = (
        "import sys, trisect\n"
        "sys.modules['mpi4py'] = None\n"
        "try: trisect.Renderer(trisect.Scene.hello_world(), 'cpu').render(1, width=8, comm=object())\n"
        "except ImportError as error: print(error)\n"
    )
    process = python(code)
    assert process.stdout == "comm needs mpi4py and an MPI library: pip install mpi4py\n", process.stderr


def test_ranks_need_a_communicator():
    pytest.importorskip("mpi4py")
    with pytest.raises(TypeError, match="not str"):
        trisect.Renderer(trisect.Scene.hello_world(), "cpu").render(1, width=8, comm="world")
