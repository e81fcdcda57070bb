"""The page: one self-contained HTML file with plots (where matplotlib is installed), tables and pictures."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from html import escape
from string import Template
from typing import Any

from ..presets import Quality
from ..scene import Float32
from ..stability.page import png
from . import plots
from .regions import REGIONS
from .sweep import describe

Report = Mapping[str, Any]
Cells = Sequence[object]

_PAGE = Template("""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Error against run time: $name</title>
<style>
:root { --ink: #1b1f24; --soft: #69707a; --line: #dde1e6; --good: #1a7f4b; --bad: #c2261d; }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 2.2rem 1.5rem 4rem; max-width: 78rem; color: var(--ink); background: #fff;
       font: 14px/1.45 system-ui, -apple-system, "Segoe UI", "Liberation Sans", Arial, sans-serif; }
h1 { font-size: 1.6rem; margin: 0 0 .2rem; }
h2 { font-size: 1.1rem; margin: 2.2rem 0 .5rem; }
p { max-width: 60rem; margin: .3rem 0; }
.soft, figcaption { color: var(--soft); }
.row { display: flex; flex-wrap: wrap; gap: 1rem 1.5rem; }
figure { margin: 0; flex: 1 1 30rem; min-width: 0; }
.pictures figure { flex: 1 1 16rem; }
figure svg { width: 100%; height: auto; }
img { width: 100%; image-rendering: pixelated; border: 1px solid var(--line); display: block; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; }
th { text-align: right; font-weight: 600; font-size: .8rem; color: var(--soft); border-bottom: 1px solid var(--ink); }
td { text-align: right; border-bottom: 1px solid var(--line); font-variant-numeric: tabular-nums; white-space: nowrap; }
th, td { padding: .3rem 1.1rem .3rem 0; }
th:first-child, td:first-child { text-align: left; }
tr.front td { font-weight: 600; }
@media print { body { font-size: 8.5pt; padding: 0; max-width: none; } figure, tr { break-inside: avoid; } }
</style>
</head>
<body>
<h1>Error against run time: $name</h1>
<p class="soft">$facts</p>
<p>$summary</p>
<div class="row">
$plots
</div>
$notes
<h2>The front, the presets, and Cycles</h2>
<p>Every error is in linear radiance over the ray traced pixels, as they show: times coverage. Ours is against our own
reference ($reference), Cycles' against its own, so that each is charged with its noise only. Seconds: translating,
building and tracing, without EEVEE; Cycles: its whole render of the rectangle around those pixels.</p>
<div class="scroll">$best</div>
<h2>Errors by region</h2>
<p>Edges: the pixels whose neighbours show another object, or which the mask covers in part.</p>
<div class="scroll">$regions</div>
<h2>Slopes</h2>
<p>A slope with its 95 % confidence interval, and what is expected of it.</p>
<div class="scroll">$slopes</div>
<h2>Bounces and cutoff alone</h2>
<p>At $knob_samples samples, against the same samples with nothing cut off. The error must not exceed residual x the
brightest radiance, taken as $brightest, in any pixel.</p>
<div class="scroll">$knobs</div>
$cycles
<h2>Pictures</h2>
<div class="row pictures">$pictures</div>
<h2>All combinations</h2>
<div class="scroll">$all</div>
</body>
</html>
""")


def render(report: Report, pictures: Mapping[str, Float32]) -> str:
    """The whole page. pictures: caption -> (h, w, 3) linear."""
    drawn = plots.draw(report)
    notes = [*report["notes"], *([] if drawn else ["no plots: matplotlib is not installed"])]
    points, front = report["points"], report["pareto"]
    host, scene, reference = report["host"], report["scene"], report["reference"]
    return _PAGE.substitute(
        name=escape(scene["name"]),
        facts=escape(
            f"{scene['resolution'][0]} x {scene['resolution'][1]}, {scene['mask_pixels']:,} ray traced pixels, "
            f"{scene['triangles']:,} triangles, {scene['lights']} lights. "
            + ", ".join(f"{name} {value}" for name, value in host.items())
        ),
        summary=escape(summary(report)),
        plots="\n".join(
            f"<figure>{svg}<figcaption>{escape(text)}</figcaption></figure>" for text, svg in drawn.items()
        ),
        notes="".join(f"<p><b>Note:</b> {escape(note)}.</p>" for note in notes),
        reference=escape(
            f"{reference['samples']} other samples, {reference['max_depth']} bounces, cutoff {reference['cutoff']:g}; "
            f"its own noise {_cell(reference['floor_rmse']['all'])}"
        ),
        best=_best(report),
        regions=_regions([points[i] for i in front]),
        slopes=_table(
            ("what", "fitted", "±", "expected"),
            [(name, s["fit"], s["ci"], s["expected"]) for name, s in report["slopes"].items() if s],
        ),
        knob_samples=report["knobs"]["samples"],
        brightest=_cell(report["knobs"]["Lmax"]),
        knobs=_table(
            ("bounces", "cutoff", "seconds", "RMSE", "residual mean", "residual max", "pixels beyond the bound"),
            [[e[key] for key in KNOBS] for e in report["knobs"]["entries"]],
        ),
        cycles=_cycles(report["cycles"]),
        pictures="".join(map(_picture, pictures, pictures.values())),
        all=_table(
            (*SETTINGS, "seconds", "RMSE", "front"),
            [(*_settings(p), p["seconds"], p["error"]["all"]["rmse"], i in front) for i, p in enumerate(points)],
        ),
    )


KNOBS = ("max_depth", "cutoff", "seconds", "rmse", "residual_mean", "residual_max", "beyond")
SETTINGS = ("samples", "bounces", "cutoff", "adaptive")
ERRORS = ("rmse", "relmse_tev", "mae", "bias", "p999", "max", "flip_ldr", "nonfinite")


def summary(report: Report) -> str:
    """What the page says, in a sentence or two."""
    slope = report["slopes"].get("aa_all")
    text = f"{len(report['points'])} settings measured, {len(report['pareto'])} of them on the front."
    if slope:
        text += f" The error falls with samples to the power {slope['fit']:.2f}"
        text += f" ± {slope['ci']:.2f}." if slope["ci"] is not None else "."
    for target in report["cycles"].get("equal_error", [])[-1:]:
        if target["ratio"]:
            text += (
                f" For RMSE {target['rmse']:.2g} Cycles takes {target['cycles']:.3g} s, the ray tracer "
                f"{target['ours']:.3g} s: Cycles / ray tracer {target['ratio']:.3g}."
            )
    return text


def _settings(point: Report) -> Cells:
    return tuple(point["settings"][name] for name in ("samples", "max_depth", "cutoff", "adaptive"))


def _best(report: Report) -> str:
    rows: list[tuple[float, Cells]] = []
    for i, p in enumerate(report["points"]):
        on_front, e, time = i in report["pareto"], p["error"]["all"], p["time"]["trace"]
        if not (on_front or p["preset"]):
            continue
        name = "front" if not p["preset"] else p["preset"] + ("" if on_front else " (behind the front)")
        errors = (e["rmse"], e["flip_ldr"], p["bound"]["residual_max"])
        cells = (name, *_settings(p), p["seconds"], time["wall_med"], time["cpu_med"], *errors)
        rows.append((p["seconds"], cells))
    for c in report["cycles"].get("points", []):
        time = c["time"]
        none = (None,) * 3
        rows.append((time["wall"], ("Cycles", c["samples"], *none, time["wall"], None, time["cpu"], c["rmse"])))
    head = ("", *SETTINGS, "seconds", "trace s", "cpu s", "RMSE", "FLIP", "residual max")
    return _table(head, [cells for _, cells in sorted(rows, key=lambda row: row[0])])


def _regions(points: Sequence[Report]) -> str:
    rows = []
    for p in points:
        name = describe(Quality(**p["settings"]))
        for region in REGIONS:
            e = p["error"][region]
            rows.append([name if region == REGIONS[0] else "", region, e["pixels"], *(e[key] for key in ERRORS)])
    head = ("setting", "region", "pixels", "RMSE", "relMSE (tev)", "MAE", "bias", "p99.9", "max", "FLIP", "not finite")
    return _table(head, rows)


def _cycles(cycles: Report) -> str:
    if "reference" not in cycles:
        return f"<h2>Cycles</h2><p>{escape(cycles['why'])}</p>"
    r, d = cycles["reference"], cycles["reference"]["difference"]
    text = (
        f"{cycles['how']}. At {r['samples']} samples ({r['seconds']:.3g} s; its noise is {_cell(r['floor_rmse'])}) it "
        f"differs from ours, inside the objects and with physical falloff, by RMSE {_cell(d['rmse'])} and on average "
        f"by {_cell(d['bias'])} (ours minus Cycles); the mean radiance there is {_cell(r['mean'])}. What "
        "remains is the model: highlights, ambient light, shadows of glass, roughness of what the objects show."
    )
    return f"<h2>Cycles</h2><p>{escape(text)}</p>"


def _picture(caption: str, picture: Float32) -> str:
    data = base64.b64encode(png(picture)).decode("ascii")
    return (
        f'<figure><img alt="{escape(caption)}" src="data:image/png;base64,{data}">'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )


def _table(head: Cells, rows: Sequence[Cells]) -> str:
    top = "".join(f"<th>{escape(str(name))}</th>" for name in head)
    body = "\n".join("<tr>" + "".join(f"<td>{_cell(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><thead><tr>{top}</tr></thead><tbody>\n{body}\n</tbody></table>"


def _cell(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else ""
    if isinstance(value, float):
        return f"{value:.3g}"
    return f"{value:,}" if isinstance(value, int) else escape(str(value))
