"""Interrupts, threads, forks, and the end of the interpreter while a render runs."""

import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import trisect
from test_scenes import small

LONG = "import trisect; r = trisect.Renderer(trisect.Scene.hello_world(), 'cpu'); r.render(1, width=8)\n"


@pytest.mark.parametrize("arguments", ["spp=10_000_000", "budget='10min'", "target_error=1e-6"])
def test_ctrl_c_ends_a_render(tmp_path, arguments):
    code = LONG + (
        "print('begins', flush=True)\n"
        f"try: r.render({arguments}, width=320)\n"
        "except KeyboardInterrupt as error:\n"
        "    frame = error.frame\n"
        "    print(type(error).__name__, frame is None or (not frame.complete and frame.image.shape == (180, 320, 3)))\n"
        "print('again', r.render(2, width=16).complete)\n"
    )
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "begins\n"
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert (out, process.returncode) == ("RenderInterrupted True\nagain True\n", 0), err


def test_another_thread_cancels():
    renderer = trisect.Renderer(trisect.Scene.hello_world(), "cpu")
    ended = []

    def render():
        try:
            renderer.render(10_000_000, width=640)
        except trisect.CancelledError as error:
            ended.append(error)

    thread = threading.Thread(target=render)
    thread.start()
    while not ended and thread.is_alive():
        renderer.cancel()
        time.sleep(0.05)
    thread.join(30)
    assert len(ended) == 1
    assert renderer.render(1, width=8).complete


def test_threads_share_a_renderer_and_a_scene():
    scene = small()
    shared = trisect.Renderer(scene, "cpu")
    expected = shared.render(16).image
    images = []

    def render(renderer):
        images.append(renderer.render(16).image)

    renderers = [shared, shared, trisect.Renderer(scene, "cpu", threads=1)]
    threads = [threading.Thread(target=render, args=(renderer,)) for renderer in renderers]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    assert len(images) == 3 and all(np.array_equal(image, expected) for image in images)


def test_the_lock_is_released():
    renderer = trisect.Renderer(trisect.Scene.hello_world(), "cpu", threads=1)
    counted = []

    def count():
        while not ended.is_set():
            counted.append(len(counted))
            time.sleep(0.001)

    ended = threading.Event()
    thread = threading.Thread(target=count)
    thread.start()
    renderer.render(60, width=320)
    ended.set()
    thread.join()
    assert len(counted) > 10


@pytest.mark.skipif(not hasattr(__import__("os"), "fork"), reason="this system has no fork")
def test_a_forked_process_says_why_it_cannot_render(python):
    code = LONG + (
        "import os, sys\n"
        "frame, s = r.render(1, width=8), r.scene\n"
        "child = os.fork()\n"
        "if child == 0:\n"
        "    tried = [lambda: r.render(1), lambda: trisect.Scene.hello_world(), lambda: trisect.Renderer(s, 'cpu')]\n"
        "    f = frame\n"
        "    tried += [lambda: f.image, lambda: f.film.mean, lambda: f.film == f.film, lambda: f.save('a.png')]\n"
        "    tried += [lambda: trisect.compare(f, f), lambda: f.film + f.film, lambda: f._repr_png_()]\n"
        "    repr(f), repr(f.film)\n"
        "    for call in tried:\n"
        "        try: call()\n"
        "        except trisect.ForkError as error: print('spawn' in str(error), flush=True)\n"
        "    del r\n"
        "    sys.exit(0)\n"
        "print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), r.render(1, width=8).complete)\n"
    )
    process = python(code)
    assert (process.stdout, process.returncode) == ("True\n" * 10 + "0 True\n", 0), process.stderr


def test_a_fork_after_a_comparison_is_noticed(python):
    code = (
        "import os, sys, numpy as np, trisect\n"
        "trisect.compare(np.zeros((9, 9, 3), np.float32), np.ones((9, 9, 3), np.float32))\n"
        "child = os.fork()\n"
        "if child == 0:\n"
        "    try: trisect.Scene.hello_world()\n"
        "    except trisect.ForkError: sys.exit(3)\n"
        "print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))\n"
    )
    process = python(code)
    assert (process.stdout, process.returncode) == ("3\n", 0), process.stderr


def test_callbacks_that_render_end_before_the_stack_does(python):
    code = (
        "import trisect\n"
        "s = trisect.Scene.hello_world()\n"
        "def recurse(p): trisect.Renderer(s, 'cpu', threads=1).render(200_000, width=32, progress=recurse)\n"
        "try: recurse(None)\n"
        "except trisect.BusyError as error: print(error)\n"
    )
    process = python(code)
    assert process.returncode == 0 and "16 renders run in each other" in process.stdout, process.stderr


def test_an_interrupt_of_the_layers_keeps_the_frame(python):
    """The signal comes after the last sample, while the layers' camera rays are traced."""
    code = LONG + (
        "import signal\n"
        "def stop(*_): raise KeyboardInterrupt\n"
        "signal.signal(signal.SIGALRM, stop)\n"
        "def told(p):\n"
        "    if p.done == p.total: signal.setitimer(signal.ITIMER_REAL, 0.05)\n"
        "r = trisect.Renderer(trisect.Scene.hello_world(), 'cpu', threads=1)\n"
        "try: r.render(16, width=400, progress=told, aov=['uv', 'geometric-normal', 'cryptomatte'])\n"
        "except KeyboardInterrupt as error:\n"
        "    print(type(error).__name__, bool((error.frame.film.samples == 16).all()), error.frame.aovs)\n"
        "else: print('the layers were not interrupted')\n"
    )
    process = python(code)
    assert process.stdout == "RenderInterrupted True {}\n", process.stderr


def test_the_interpreter_ends_while_a_render_runs(python):
    code = LONG + (
        "import threading, time\n"
        "threading.Thread(target=lambda: r.render(10_000_000, width=640, progress=lambda p: None), daemon=True).start()\n"
        "time.sleep(0.5)\n"
    )
    process = python(code)
    assert process.returncode == 0, process.stderr
    assert "panicked" not in process.stderr and "Fatal" not in process.stderr
