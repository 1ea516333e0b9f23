"""The notebooks run in a kernel, and their pages have their code and output."""

import copy
import functools
import io
import os
import pathlib
import sys

import numpy as np
import pytest

pytest.importorskip("jupytext")
pytest.importorskip("ipykernel")
nbclient = pytest.importorskip("nbclient")
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import notebook_page  # noqa: E402

# Parameters that make a notebook short enough for a test.
SMALL = {"variants": {"count": 80}, "equal_time_race": {"seconds": 0.05, "seeds": 2}}
PICTURES = {"first_render": 1, "noise_and_bias": 0, "optimise": 1, "variants": 1, "equal_time_race": 1}


def pixels(png):
    return np.asarray(pytest.importorskip("PIL.Image").open(io.BytesIO(png)).convert("RGB"), np.float32)


def differences(name, notebook, page, pictures):
    """What of an executed notebook a page and its pictures do not show."""
    now, drawn = notebook_page.render(name, notebook)
    found = []
    if notebook_page.masked(now, notebook) != notebook_page.masked(page, notebook):
        found.append(f"{name}.md has other code or output; run host/python/notebook_page.py {name}")
    if drawn.keys() != pictures.keys():
        found.append(f"pictures {sorted(drawn)}, beside the page {sorted(pictures)}")
    cells = [cell for cell in notebook.cells if notebook_page.pictures_of(cell)]
    for file, cell in zip(drawn, cells):
        if "varies" not in notebook_page.tags(cell) and file in pictures:
            new, old = pixels(drawn[file]), pixels(pictures[file])
            if new.shape != old.shape or np.abs(new - old).mean() > 1:
                found.append(f"{file} is another picture")
    return found


def shown(name):
    """The page of a notebook, and its pictures."""
    files = notebook_page.PAGES.glob(f"{name}_*.png")
    return (notebook_page.PAGES / f"{name}.md").read_text(), {file.name: file.read_bytes() for file in files}


@functools.cache
def executed(name):
    return notebook_page.execute(notebook_page.read(name), SMALL.get(name))


def require_mitsuba():
    mitsuba = pytest.importorskip("mitsuba")
    try:
        mitsuba.set_variant("llvm_ad_rgb")
        mitsuba.load_dict({"type": "sphere"})
    except Exception as error:
        pytest.skip(f"Mitsuba's variant llvm_ad_rgb does not run: {error}")


@pytest.mark.parametrize("name", PICTURES)
def test_notebooks(name):
    if name == "equal_time_race":
        require_mitsuba()
    notebook = executed(name)
    assert all(output.output_type != "error" for cell in notebook.cells for output in cell.get("outputs", []))
    text = "".join(notebook_page.text_of(cell) for cell in notebook.cells)
    pictures = [png for cell in notebook.cells for png in notebook_page.pictures_of(cell)]
    assert text and len(pictures) == PICTURES[name]
    assert all(pixels(png).std() > 5 for png in pictures)
    if os.environ.get("UPDATE_DOCS"):
        notebook_page.main([name])
    assert differences(name, notebook, *shown(name)) == []


def test_all_notebooks_are_executed_and_shown():
    assert sorted(PICTURES) == notebook_page.names()
    assert sorted(path.stem for path in notebook_page.PAGES.glob("*.md")) == sorted([*PICTURES, "README"])


def test_a_failing_cell_is_noticed():
    """Negative control."""
    notebook = notebook_page.read("first_render")
    notebook.cells = [copy.deepcopy(cell) for cell in notebook.cells[:2]]
    notebook.cells[1].source = "import trisect\ntrisect.Scene.load('missing.ron')"
    with pytest.raises(nbclient.exceptions.CellExecutionError, match="SceneError"):
        notebook_page.execute(notebook)


def test_a_stale_page_is_noticed():
    """Negative control."""
    name = "variants"
    notebook = executed(name)
    page, pictures = notebook_page.render(name, notebook)
    assert differences(name, notebook, page, pictures) == []
    [line] = [line for line in page.splitlines() if line.startswith("80 variants on")]
    assert differences(name, notebook, page.replace(line, line.replace("80", "10000")), pictures) == []
    for old, new in [("per second", "a second"), ("mean radiance [0.", "mean radiance [1."), ("10_000", "100")]:
        changed = page.replace(old, new)
        assert changed != page and len(differences(name, notebook, changed, pictures)) == 1, old
    assert len(differences(name, notebook, page, {})) == 1
