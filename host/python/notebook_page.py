"""Executes the notebooks and writes their code and output as pages of the documentation.

    python host/python/notebook_page.py [NAME…]

It needs the module and host/python/tests/requirements.txt, and about two minutes of a machine without other work.
The tag "varies" marks cells whose output differs between runs or machines; the tag "parameters" a cell of sizes, which
the tests lower.
"""

import base64
import os
import pathlib
import re
import sys
import tempfile

import jupytext
import nbclient
from traitlets.config import Config

ROOT = pathlib.Path(__file__).resolve().parents[2]
NOTEBOOKS = ROOT / "host" / "python" / "notebooks"
PAGES = ROOT / "docs" / "tutorial" / "notebooks"


def names():
    return sorted(path.stem for path in NOTEBOOKS.glob("*.py"))


def read(name):
    """Returns a notebook that was not executed."""
    return jupytext.read(NOTEBOOKS / f"{name}.py")


def tags(cell):
    return cell.metadata.get("tags", [])


def execute(notebook, parameters=None, timeout=600):
    """Executes a notebook in a kernel of its own. Raises CellExecutionError for a cell that fails.

    `parameters` are values that replace those of the cell with the tag "parameters".
    """
    sources = [cell.source for cell in notebook.cells]
    for cell in notebook.cells:
        if parameters and "parameters" in tags(cell):
            cell.source += "".join(f"\n{name} = {value!r}" for name, value in parameters.items())
    with tempfile.TemporaryDirectory() as folder:
        # Neither settings nor the history of the user, and sockets that are files.
        env = {**os.environ, "IPYTHONDIR": folder, "JUPYTER_CONFIG_DIR": folder}
        config = Config(KernelManager={"transport": "ipc", "ip": f"{folder}/kernel"})
        resources = {"metadata": {"path": str(ROOT)}}
        client = nbclient.NotebookClient(
            notebook, kernel_name="python3", config=config, timeout=timeout, resources=resources
        )
        client.execute(env=env)
    for cell, source in zip(notebook.cells, sources):
        cell.source = source
    return notebook


def text_of(cell):
    """Returns the text that a cell printed, and that of its values that are no pictures."""
    parts = []
    for output in cell.get("outputs", []):
        if output.output_type == "stream":
            parts.append(output.text)
        elif "image/png" not in output.data:
            parts.append(output.data.get("text/plain", "") + "\n")
    return "".join(parts)


def pictures_of(cell):
    """Returns the PNG files of a cell's output."""
    outputs = [output for output in cell.get("outputs", []) if output.output_type != "stream"]
    return [base64.b64decode(output.data["image/png"]) for output in outputs if "image/png" in output.data]


def render(name, notebook):
    """Returns the page of a notebook, and the bytes of its pictures by file name."""
    parts, pictures = [], {}
    title = notebook.cells[0].source.splitlines()[0].lstrip("# ")
    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            parts.append(cell.source.replace("](../../../docs/", "](../../"))
            continue
        parts.append(f"```python\n{cell.source.strip()}\n```")
        if text := text_of(cell):
            parts.append(f"```text\n{text.rstrip()}\n```")
        for png in pictures_of(cell):
            file = f"{name}_{len(pictures) + 1}.png"
            pictures[file] = png
            parts.append(f"![{title}]({file})")
    return "\n\n".join(parts) + "\n", pictures


def masked(page, notebook):
    """Returns a page with `#` in place of the numbers in output that varies."""
    varying = {cell.source.strip() for cell in notebook.cells if "varies" in tags(cell)}
    fences = re.split(r"^```python\n(.*?)\n```$", page, flags=re.DOTALL | re.MULTILINE)
    for index in range(1, len(fences), 2):
        if fences[index] in varying and (output := re.match(r"\s*```text\n.*?\n```\n", fences[index + 1], re.DOTALL)):
            rest = fences[index + 1][output.end() :]
            fences[index + 1] = re.sub(r"\d+(\.\d+)?", "#", output[0]) + rest
    return "".join(fences)


def main(chosen):
    for name in chosen or names():
        page, pictures = render(name, execute(read(name)))
        (PAGES / f"{name}.md").write_text(page)
        for file, png in pictures.items():
            (PAGES / file).write_bytes(png)
        print(f"{name}: {len(page.splitlines())} lines, pictures of {[len(png) for png in pictures.values()]} bytes")


if __name__ == "__main__":
    main(sys.argv[1:])
