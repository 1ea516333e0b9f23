"""Makes a wheel of the library that a build of the workspace has compiled.

    python host/python/pack.py target/release/lib_trisect.so FOLDER

A build by maturin would compile all dependencies again, with other features. The wheel is for this
machine. It needs the package `wheel`, which writes the list of files.
"""

import pathlib
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import tomllib


def metadata(project, version):
    lines = [
        "Metadata-Version: 2.1",
        f"Name: {project['name']}",
        f"Version: {version}",
        f"Summary: {project['description']}",
        f"Requires-Python: {project['requires-python']}",
        *(f"Requires-Dist: {one}" for one in project["dependencies"]),
    ]
    for extra, needs in project["optional-dependencies"].items():
        lines.append(f"Provides-Extra: {extra}")
        lines += [f"Requires-Dist: {one}; extra == '{extra}'" for one in needs]
    return "\n".join(lines) + "\n"


def main(library, folder):
    here = pathlib.Path(__file__).resolve().parent
    project = tomllib.loads((here / "pyproject.toml").read_text())["project"]
    version = tomllib.loads((here / "../../Cargo.toml").read_text())["workspace"]["package"]["version"]
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    with tempfile.TemporaryDirectory() as root:
        package = pathlib.Path(root) / "trisect"
        shutil.copytree(here / "python" / "trisect", package, ignore=shutil.ignore_patterns("__pycache__", "*.so"))
        shutil.copy(library, package / "_trisect.abi3.so")
        info = pathlib.Path(root) / f"trisect-{version}.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(metadata(project, version))
        tag = f"Wheel-Version: 1.0\nGenerator: pack.py\nRoot-Is-Purelib: false\nTag: cp39-abi3-{platform}\n"
        (info / "WHEEL").write_text(tag)
        subprocess.run([sys.executable, "-m", "wheel", "pack", root, "-d", folder], check=True)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(pathlib.Path(sys.argv[1]), sys.argv[2])
