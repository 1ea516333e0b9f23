"""Measurements of options: reports, tables, charts, interrupts and bad arguments."""

import html.parser
import json
import math
import subprocess
import sys

import pytest

import trisect
from test_scenes import small

KNOBS = ["sampler", "clamp", "scale"]
SIZE = dict(backend="cpu", width=16, height=16, seeds=4, reference_spp=16)


def faults(root, name, report):
    """What is wrong with a report by the published schema, without any further key."""
    jsonschema = pytest.importorskip("jsonschema")
    schema = json.loads((root / "docs" / "reference" / "schemas" / f"{name}.json").read_text())

    def close(of):
        for value in of.values() if isinstance(of, dict) else of if isinstance(of, list) else ():
            close(value)
        if isinstance(of, dict) and "properties" in of:
            of.setdefault("additionalProperties", False)

    close(schema)
    return [str(error) for error in jsonschema.Draft202012Validator(schema).iter_errors(report)]


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("references")


@pytest.fixture(scope="module")
def scene(root):
    return trisect.Scene.load(root / "scenes" / "cornell_box.ron", set={"camera.vertical_fov": 39})


@pytest.fixture(scope="module")
def told():
    return []


@pytest.fixture(scope="module")
def measured(scene, cache, told):
    return trisect.tradeoff(scene, knobs=KNOBS, spp=[4, 1], cache=cache, progress=told.append, **SIZE)


@pytest.fixture(scope="module")
def curves(scene, cache):
    return trisect.converge(scene, knobs="sampler, clamp", first=1, last=4, cache=cache, **SIZE)


@pytest.fixture(scope="module")
def printed(program, root, cache, tmp_path_factory):
    """Runs a command of the program for the same measurement, and returns its JSON."""

    def run(command, *words, size=16):
        words += "--backend", "cpu", "--width", str(size), "--height", str(size), "--seeds", "4"
        words += "--reference-spp", "16", "--cache", cache, "--json"
        words = [program, command, root / "scenes" / "cornell_box.ron", "--set", "camera.vertical_fov=39", *words]
        folder = tmp_path_factory.mktemp("program")
        process = subprocess.run(words, cwd=folder, capture_output=True)
        assert process.returncode == 0, process.stderr
        return json.loads(process.stdout), folder

    return run


def test_reports_are_valid(root, measured, curves):
    assert faults(root, "tradeoff", measured.report) == []
    assert faults(root, "converge", curves.report) == []
    # Negative control.
    assert faults(root, "tradeoff", {**measured.report, "seeds": "four"}) and faults(root, "converge", {})


def test_the_program_measures_the_same(printed, measured):
    found, folder = printed("tradeoff", "--knobs", ",".join(KNOBS), "--levels", "1,4", "-q")
    for ours, theirs in zip(measured.report["points"], found["points"]):
        names = "knob", "level", "spp", "exact", "errors"
        assert [ours[name] for name in names] == [theirs[name] for name in names]
        words = [point["command"] and sorted(point["command"].split()) for point in (ours, theirs)]
        assert words[0] == words[1]
    assert len(measured.report["points"]) == len(found["points"]) == 14
    alike = "format", "version", "scene", "device", "width", "height", "depth", "reference", "seeds", "missing", "ended"
    assert [measured.report[name] for name in alike] == [found[name] for name in alike]
    header = (folder / "tradeoff" / "tradeoff.csv").read_text().splitlines()[0].split(",")
    assert all(name in measured.table[0] for name in header)


def test_the_program_measures_the_same_curves(printed, curves):
    found, _ = printed("converge", "--knobs", "sampler,clamp", "--first", "1", "--last", "4")
    assert curves.report == found


def test_defaults_are_those_of_the_program(printed, scene, cache):
    tradeoff, _ = printed("tradeoff", "--levels", "1", "-q", size=8)
    converge, _ = printed("converge", "--first", "1", "--last", "4", size=8)
    tiny = dict(SIZE, width=8, height=8, cache=cache)
    names = lambda report: [(point["knob"], point["level"]) for point in report["points"] + report["missing"]]
    assert names(trisect.tradeoff(scene, spp=1, **tiny).report) == names(tradeoff)
    modes = lambda report: [course["mode"] for course in report["courses"]]
    assert modes(trisect.converge(scene, first=1, last=4, **tiny).report) == modes(converge)


def test_tables_have_rows_of_plain_values(measured, curves):
    for table, count in [(measured.table, 14), (curves.table, 15)]:
        assert len(table) == count and all(row.keys() == table[0].keys() for row in table)
        assert {type(value) for row in table for value in row.values()} <= {type(None), bool, int, float, str}
    row = measured.table[0]
    point = measured.report["points"][0]
    assert (row["knob"], row["spp"], row["seconds"]) == ("base", 1, point["seconds"]["all"]["median"])
    assert row["rel_mse_high"] == point["errors"]["rel_mse"]["high"]
    assert math.isclose(row["error"] ** 2, row["rel_mse"])
    assert row["against_base"] is None and measured.table[-1]["against_base"] > 0
    last = curves.report["courses"][-1]
    assert curves.table[-1]["slope"] == last["slope"]["value"] and curves.table[-1]["mode"] == "clamp 1"


def test_progress_names_stages_and_results(measured, told):
    stages = {one.stage for one in told}
    assert "reference" in stages and "sampler independent, 4 samples a pixel" in stages
    results = [one.message for one in told if one.message]
    assert sum(message.startswith("clamp") for message in results) == 6
    last = told[-1]
    assert last.done == last.total == 14 and 0 < last.seconds and 0 < last.left < 480


def test_a_built_scene_has_no_command(root, cache, tmp_path):
    result = trisect.tradeoff(small(), knobs="depth", spp=[64], cache=cache, **SIZE)
    assert faults(root, "tradeoff", result.report) == []
    assert {row["command"] for row in result.table} == {None}
    assert result.reference["samples"] >= 16 and result.complete
    assert result.advice.startswith(("For this scene use", "No setting can be recommended"))
    assert "--" not in result.advice
    for name in ["report.json", "page.html"]:
        result.save(tmp_path / name)
    assert json.loads((tmp_path / "report.json").read_text()) == result.report
    page = (tmp_path / "page.html").read_text()
    assert page.startswith("<!DOCTYPE html>") and "</html>" in page
    with pytest.raises(trisect.SettingsError, match="must end in .json or .html"):
        result.save(tmp_path / "report.txt")
    with pytest.raises(trisect.ImageError, match="No such file"):
        result.save(tmp_path / "no" / "report.json")


def test_notebooks_show_tables(measured, curves):
    class Cells(html.parser.HTMLParser):
        rows, depth = 0, 0

        def handle_starttag(self, tag, attrs):
            self.rows += tag == "tr"
            self.depth += 1

        def handle_endtag(self, tag):
            self.depth -= 1

    for result, rows in [(measured, 15), (curves, 16)]:
        cells = Cells()
        cells.feed(result._repr_html_())
        assert (cells.rows, cells.depth) == (rows, 0)


def test_charts(measured, curves):
    pytest.importorskip("matplotlib").use("Agg")
    from matplotlib import pyplot

    axes = measured.plot()
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
    assert axes.get_xlabel().endswith(", s") and axes.get_ylabel() == "relative error, %"
    assert sum(len(points.get_offsets()) for points in axes.collections) == 14
    front = [row for row in measured.table if row["on_front"]]
    [line] = axes.lines
    assert sorted(line.get_ydata()) == pytest.approx(sorted(100 * row["error"] for row in front))
    assert len(axes.texts) == len(front)
    given = pyplot.figure().add_subplot()
    assert curves.plot(given) is given and curves.plot(ax=given) is given
    labels = given.get_legend_handles_labels()[1]
    assert any(label.startswith("sampler independent (") for label in labels)
    pyplot.close("all")


def test_charts_need_matplotlib(measured, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", None)
    with pytest.raises(ImportError, match="pip install matplotlib"):
        measured.plot()


TINY = "knobs='sampler', seeds=4, reference_spp=4, backend='cpu', width=16, height=16, cache='.', progress=told"


@pytest.mark.parametrize(
    "call, stage, send, measured",
    [
        # The second level never ends, and the signal comes from another thread.
        (f"tradeoff(scene, spp=[1, 10_000_000], {TINY})", "10000000", "threading.Timer(0.1, interrupt).start()", "points"),
        (f"converge(scene, first=1, last=64, {TINY})", " 16 ", "interrupt()", "courses"),
    ],
)
def test_ctrl_c_ends_a_measurement(python, call, stage, send, measured):
    code = (
        "import os, signal, threading, trisect\n"
        "scene, sent = trisect.Scene.hello_world(), []\n"
        "def interrupt(): os.kill(os.getpid(), signal.SIGINT)\n"
        "def told(p):\n"
        f"    if not sent and '{stage}' in p.stage:\n"
        "        sent.append(p)\n"
        f"        {send}\n"
        f"try: trisect.{call}\n"
        "except KeyboardInterrupt as error:\n"
        "    result = error.result\n"
        f"    print(type(error).__name__, result.report['ended'], result.complete, len(result.report['{measured}']) > 0)\n"
    )
    process = python(code)
    assert process.stdout == "MeasurementInterrupted interrupted False True\n", process.stderr


def test_an_exception_of_the_callback_ends_a_measurement(cache):
    def told(progress):
        raise LookupError(progress.stage)

    with pytest.raises(LookupError, match="reference|base"):
        trisect.tradeoff(small(), knobs="depth", spp=[1], progress=told, cache=cache, **SIZE)


def test_the_time_limit_ends_a_measurement(root, cache):
    scene = small()
    result = trisect.tradeoff(scene, knobs="sampler", spp=[1, 10_000_000], time_limit=0.8, cache=cache, **SIZE)
    assert not result.complete and result.report["ended"] == "out_of_time"
    assert {point["spp"] for point in result.report["points"]} <= {1} and len(result.report["missing"]) == 2
    assert faults(root, "tradeoff", result.report) == []


def test_bad_arguments(cache, tmp_path):
    good = dict(SIZE, knobs="depth", cache=cache)
    (tmp_path / "file").write_text("")
    for arguments, text, place in [
        ({"knobs": ["sampler", "colour"]}, 'unknown knob "colour" in `knobs`; available: sampler,', "knobs"),
        ({"knobs": []}, r"knobs is \[\]; it must be names", "knobs"),
        ({"knobs": 3}, "knobs is 3", "knobs"),
        ({"knobs": [3]}, r"knobs is \[3\]", "knobs"),
        ({"seeds": 3}, "`seeds` is 3; it must be at least 4", "seeds"),
        ({"seeds": 2000}, "seeds is 2000; it must be a whole number from 4 to 1024", "seeds"),
        ({"seeds": "many"}, "seeds is 'many'", "seeds"),
        ({"seeds": True}, "seeds is True", "seeds"),
        ({"time_limit": -1}, "time_limit is -1; write it as seconds", "time_limit"),
        ({"time_limit": "soon"}, "time_limit is 'soon'", "time_limit"),
        ({"time_limit": math.inf}, "time_limit is inf", "time_limit"),
        ({"reference_spp": 0}, "reference_spp is 0", "reference_spp"),
        ({"cache": 3}, "cache is 3; it must be the path of a folder", "cache"),
        ({"device": -1}, "device is -1", "device"),
        ({"width": 0}, "width is 0", "width"),
        ({"depth": 10**6}, "depth", None),
        ({"sampler": "halton"}, "it must be one of sobol, independent", "sampler"),
        ({"roulette": False, "roulette_depth": 3}, "roulette_depth has no effect", "roulette_depth"),
        ({"progress": 3}, "progress is 3", "progress"),
        ({"backend": "vulkan"}, "auto, cpu, wgpu, cuda", "backend"),
    ]:
        for function in (trisect.tradeoff, trisect.converge):
            with pytest.raises(trisect.SettingsError, match=text) as raised:
                function(small(), **{**good, **arguments})
            assert place is None or raised.value.place == place
    assert raised.value.remedy
    for arguments, text in [
        ({"spp": 0}, "spp is 0"),
        ({"spp": [4, -1]}, r"spp is \[4, -1\]"),
        ({"spp": []}, r"spp is \[\]"),
        ({"spp": "4"}, "spp is '4'"),
        ({"spp": True}, "spp is True"),
        ({"max_spp": 2.5}, "max_spp is 2.5"),
        ({"spp": 4, "max_spp": 4}, "cannot be combined"),
    ]:
        with pytest.raises(trisect.SettingsError, match=text):
            trisect.tradeoff(small(), **good, **arguments)
    for arguments, text in [
        ({"first": 0}, "first is 0"),
        ({"first": 4, "last": 8}, "doublings from `first` to `last` is 1; it must be at least 2"),
        ({"first": 8, "last": 4}, "doublings"),
    ]:
        with pytest.raises(trisect.SettingsError, match=text):
            trisect.converge(small(), **good, **arguments)
    for function in (trisect.tradeoff, trisect.converge):
        with pytest.raises(TypeError, match="unexpected keyword argument .aov."):
            function(small(), aov="depth")
        with pytest.raises(TypeError):
            function("scene.ron")
        with pytest.raises(trisect.LabError, match="references are kept there") as raised:
            function(small(), **{**good, "cache": tmp_path / "file"}, **({"spp": 1} if function is trisect.tradeoff else {"last": 64}))
        assert raised.value.file.startswith(str(tmp_path / "file"))


def test_images_of_others(root, scene, cache, tmp_path):
    """Images of the scene itself stand for those of another renderer."""
    renderer = trisect.Renderer(scene, "cpu")
    folder = tmp_path / "others" / "same"
    folder.mkdir(parents=True)
    for seed in range(4):
        renderer.render(16, width=16, height=16, seed=seed, sampler="independent").save(folder / f"{seed}.exr")
    (folder / "times.json").write_text('{"seconds": 0.5}')
    found = trisect.tradeoff(scene, knobs=["depth"], spp=16, cache=cache, against=folder.parent, sampler="independent", **SIZE)
    [other] = found.report["others"]
    assert other["name"] == "same" and not other["errors"]["biased"]
    base = next(row for row in found.table if row["knob"] == "base")
    assert 0.5 < other["errors"]["variance"]["value"] / base["variance"] < 2
    assert other["efficiency_of_base"]["value"] < 1
    assert not faults(root, "tradeoff", found.report)
    with pytest.raises(trisect.LabError, match="16x16 pixels"):
        trisect.tradeoff(scene, against=folder.parent, cache=cache, backend="cpu", width=17, height=16)
    # Bad images are found before anything is measured.
    (folder / "9.exr").write_bytes((folder / "0.exr").read_bytes())
    with pytest.raises(trisect.LabError, match="9.exr: equal to .*0.exr"):
        trisect.tradeoff(scene, against=folder.parent, cache=cache, **SIZE)
    with pytest.raises(trisect.LabError, match="nosuch"):
        trisect.tradeoff(scene, against=tmp_path / "nosuch", cache=cache, **SIZE)
