"""What the tests share: the program, its scenes, and processes that run Python."""

import os
import pathlib
import signal
import subprocess
import sys

import pytest

# A shell's background job ignores Ctrl-C, and its processes inherit that.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

ROOT = pathlib.Path(__file__).resolve().parents[3]


@pytest.fixture(scope="session")
def root():
    return ROOT


@pytest.fixture(scope="session")
def program():
    """Path of the program; a test that needs it is skipped aloud without it."""
    path = os.environ.get("TRISECT_BIN", str(ROOT / "target" / "release" / "trisect"))
    if not os.access(path, os.X_OK):
        pytest.skip(f"there is no program at {path}; set TRISECT_BIN")
    return path


@pytest.fixture
def python(tmp_path):
    """Runs Python code in a process of its own, and returns the finished process."""

    def run(code, timeout=60, **keywords):
        return subprocess.run(
            [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=timeout, **keywords
        )

    return run
