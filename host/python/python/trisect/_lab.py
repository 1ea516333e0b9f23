"""Charts and tables of measurements."""

from __future__ import annotations

import html
import importlib
import typing as t

if t.TYPE_CHECKING:
    from ._trisect import Convergence, Tradeoff

_Rows = t.List[t.Dict[str, t.Any]]


def _axes(ax: t.Any) -> t.Any:
    """Return the axes, or new ones."""
    try:
        pyplot = importlib.import_module("matplotlib.pyplot")
    except ImportError as error:
        raise ImportError("plot() needs matplotlib: pip install matplotlib", name="matplotlib") from error
    return pyplot.subplots()[1] if ax is None else ax


def _percent(value: t.Optional[float]) -> t.Optional[float]:
    """Return a share in percent; None for what a logarithmic axis cannot show."""
    return 100 * value if value else None


def _setting(row: t.Dict[str, t.Any]) -> str:
    return "base" if row["knob"] == "base" else f"{row['knob']} {row['level']}"


def plot_tradeoff(result: Tradeoff, ax: t.Any) -> t.Any:
    """Draw error over time, with the Pareto front."""
    ax = _axes(ax)
    rows = [row for row in result.table if _percent(row["error"]) and row["seconds"]]
    for is_biased, label, style in [
        (False, "no bias seen", {"facecolors": "C0"}),
        (True, "biased", {"facecolors": "none"}),
    ]:
        of = [row for row in rows if row["biased"] == is_biased]
        if of:
            at = [row["seconds"] for row in of], [_percent(row["error"]) for row in of]
            ax.scatter(*at, edgecolors="C0", label=label, zorder=2, **style)
    front = sorted((row for row in rows if row["on_front"]), key=lambda row: row["seconds"])
    if front:
        at = [row["seconds"] for row in front], [_percent(row["error"]) for row in front]
        ax.plot(*at, color="C1", label="Pareto front", zorder=1)
    for row in front:
        at_point = row["seconds"], _percent(row["error"])
        text = f"{_setting(row)}, {row['spp']} spp"
        ax.annotate(text, at_point, textcoords="offset points", xytext=(4, 4), fontsize="x-small")
    report = result.report
    ax.set_title(f"{report['scene']}, {report['width']}x{report['height']}, {report['device']}", fontsize="small")
    return _finish(ax, "time of a render, s")


def plot_convergence(result: Convergence, ax: t.Any) -> t.Any:
    """Draw the error curves, with the slope of noise."""
    ax = _axes(ax)
    for mode, of in _curves(result.table).items():
        slope = of[-1]["slope"]
        label = mode if slope is None else f"{mode} ({slope:.2f})"
        rows = [row for row in of if _percent(row["error"])]
        x, y = [row["spp"] for row in rows], [100 * row["error"] for row in rows]
        low = [100 * max(row["error"] - (row["error_low"] or 0), 0) for row in rows]
        high = [100 * max((row["error_high"] or row["error"]) - row["error"], 0) for row in rows]
        ax.errorbar(x, y, yerr=[low, high], marker="o", markersize=3, capsize=2, label=label)
        if mode == "base" and len(x) > 1:
            noise = [y[0] * (x[0] / at) ** 0.5 for at in x]
            ax.plot(x, noise, color="grey", linestyle=":", label="slope of noise (-0.5)")
    ax.set_title(result.report["scene"], fontsize="small")
    return _finish(ax, "samples per pixel")


def _finish(ax: t.Any, x: str) -> t.Any:
    ax.set(xscale="log", yscale="log", xlabel=x, ylabel="relative error, %")
    ax.grid(True, which="both", alpha=0.2)
    if ax.get_legend_handles_labels()[0]:
        ax.legend(fontsize="x-small")
    return ax


def _curves(rows: _Rows) -> t.Dict[str, _Rows]:
    """Return the rows of each configuration."""
    curves: t.Dict[str, _Rows] = {}
    for row in rows:
        curves.setdefault(row["mode"], []).append(row)
    return curves


def _number(value: t.Optional[float], form: str) -> str:
    return "" if value is None else format(value, form)


def _errors(row: t.Dict[str, t.Any]) -> t.List[str]:
    """Return the error in percent, and its interval."""
    percent = [_number(_percent(row[name]), ".3f") for name in ("error", "error_low", "error_high")]
    return [percent[0], f"{percent[1] or 0} to {percent[2]}"]


def _table(head: t.Sequence[str], body: t.Iterable[t.Sequence[str]]) -> str:
    def row(kind: str, cells: t.Sequence[str]) -> str:
        return "<tr>" + "".join(f"<{kind}>{html.escape(cell)}</{kind}>" for cell in cells) + "</tr>"

    rows = "".join(row("td", cells) for cells in body)
    return f"<table><thead>{row('th', head)}</thead><tbody>{rows}</tbody></table>"


def tradeoff_html(result: Tradeoff) -> str:
    """Return the advice, and a table of all points."""
    head = ["setting", "spp", "time, s", "error, %", "95 % interval", "efficiency over the base's", "verdict"]
    body = [
        [_setting(row), str(row["spp"]), _number(row["seconds"], ".4g"), *_errors(row)]
        + [_number(row["against_base"], ".2f"), row["verdict"]]
        for row in result.table
    ]
    return f"<p>{html.escape(result.advice)}</p>" + _table(head, body)


def convergence_html(result: Convergence) -> str:
    """Return a table of all error curves."""
    head = ["configuration", "spp", "error, %", "95 % interval", "slope", "verdict"]
    body = []
    for mode, rows in _curves(result.table).items():
        for row in rows:
            of_curve = [_number(row["slope"], ".3f"), row["verdict"]] if row is rows[-1] else ["", ""]
            body.append([mode, str(row["spp"]), *_errors(row), *of_curve])
    return _table(head, body)
