"""Makes the tables of docs/notebook/tradeoff-fronts.md from what `trisect tradeoff` writes.

    fronts.py FOLDER      FOLDER has one folder per scene, with its tradeoff.json

Needs Python 3.8 and no packages.
"""

import json
import sys
from pathlib import Path

SCENES = {
    "rtiow_final": "book",
    "cornell_box": "Cornell box",
    "veach_mis": "MIS",
    "furnace": "furnace",
    "mesh": "mesh",
    "many_lights": "1,000 lights",
}
ROWS = [
    ("`--sampler sobol`", "sampler", "sobol"),
    ("roulette from segment 4", "roulette", "from segment 4"),
    ("roulette from segment 1", "roulette", "from segment 1"),
    ("both: Sobol, roulette from 4", "together", "sobol, roulette"),
    ("`--denoise svgf`", "denoiser", "svgf"),
    ("svgf, `color` 3", "denoiser", "svgf, color 3"),
    ("svgf, 3 levels", "denoiser", "svgf, 3 levels"),
    ("`--denoise atrous`", "denoiser", "atrous"),
    ("Sobol, roulette, svgf", "together", "sobol, roulette, svgf"),
    ("`--depth 4`", "depth", "4"),
    ("`--depth 8`", "depth", "8"),
    ("half the resolution", "scale", "1/2"),
    ("`--clamp 4`", "clamp", "4"),
    ("`--light-sampling off`", "lights", "found by chance"),
    ("binary tree", "traversal", "binary tree"),
    ("`--math fast`", "math", "fast"),
]


def percent(square):
    value = 100 * max(square, 0.0) ** 0.5
    return f"{value:.0f} %" if value >= 100 else f"{value:.1f} %"


def time(point):
    milliseconds = 1e3 * point["seconds"]["all"]["median"]
    return f"{milliseconds:.1f} ms" if milliseconds < 10 else f"{milliseconds:.0f} ms"


def find(found, knob, level):
    """Returns the point of a knob and level at the maximum number of samples per pixel, or None."""
    spp = max(point["spp"] for point in found["points"])
    points = [p for p in found["points"] if (p["knob"], p["level"], p["spp"]) == (knob, level, spp)]
    return points[0] if points else None


def cell(point):
    if point is None:
        return ""
    against, errors = point["against"], point["errors"]
    biased = errors["biased"] and not point["exact"]
    if not against["measurable"] and not biased:
        return "–"
    text = f"{against['efficiency']['value']:.2f}"
    if biased:
        text += f", {percent(errors['squared_bias']['value'])}"
    elif errors["biased"]:
        text += " (rare)"
    return text


def main():
    root = Path(sys.argv[1])
    found = {name: json.loads((root / name / "tradeoff.json").read_text()) for name in SCENES if (root / name).is_dir()}
    print("| | " + " | ".join(SCENES[name] for name in found) + " |")
    print("|---" * (len(found) + 1) + "|")
    base = [find(one, "base", "as asked") for one in found.values()]
    cells = [f"{percent(point['errors']['rel_mse']['value'])}, {time(point)}" for point in base]
    print("| as it is | " + " | ".join(cells) + " |")
    for title, knob, level in ROWS:
        cells = [cell(find(one, knob, level)) for one in found.values()]
        if any(cells):
            print(f"| {title} | " + " | ".join(cells) + " |")
    print()
    for name, one in found.items():
        front = sorted((p for p in one["points"] if p["on_front"]), key=lambda p: p["seconds"]["all"]["median"])
        words = []
        for point in front:
            way = point["level"] if point["knob"] == "together" else f"{point['knob']} {point['level']}"
            way = f"{way}, {point['spp']} spp: {time(point)}, {percent(point['errors']['rel_mse']['value'])}"
            words.append(f"*{way}*" if point["errors"]["biased"] else way)
        print(f"| {SCENES[name]} | " + "; ".join(words) + " |")
    print()
    for name, one in found.items():
        print(f"{name}: {len(one['points'])} points, at most {max(p['spp'] for p in one['points'])} samples, in {one['seconds']:.0f} s, drift {100 * one['drift']:.0f} %, on {one['device']}")


if __name__ == "__main__":
    main()
