# SPDX-License-Identifier: GPL-3.0-or-later
"""The page: one self-contained HTML file with plots (where matplotlib is installed), tables and pictures."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from html import escape
from string import Template
from typing import Any

from ...scene import Float32
from ..stability.page import png
from . import plots, tables
from .metrics import SHOWN

Report = Mapping[str, Any]

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
th.text, td.text { text-align: left; white-space: normal; }
th, td { padding: .3rem 1.1rem .3rem 0; }
th:first-child, td:first-child { text-align: left; }
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
<h2>The presets</h2>
<p>On the front is what no other setting clearly beats: none is 10 % faster with an error at most 1 % larger, and none
errs 5 % less in no more time, by two standard errors. Which of two that are nearer is better, the next run may see
otherwise.</p>
<div class="scroll">$presets</div>
<h2>The front, the presets, and Cycles</h2>
<p>Every error is over the ray traced pixels, in linear radiance times coverage. <b>RMSE shown</b>, by which all is
judged and plotted, counts what is brighter than the screen's white as white: else the few pixels of a lamp's image
would decide alone. FLIP is what an eye sees of it. RMSE has all of the radiance. Ours is against our own
reference ($reference), Cycles' against its own, so that each is charged with its noise only. A reference is the mean of
two pictures: a pixel's squared error is the product of its differences from the one and from the other, in which their
noise cancels in the mean. Clear: the mean square is larger than three of its standard errors. Seconds: translating,
building and tracing, without EEVEE; Cycles: its whole render of the rectangle around those pixels.</p>
<div class="scroll">$best</div>
<h2>Errors by region</h2>
<p>Edges: the pixels whose neighbours show another object, or which the mask covers in part.</p>
<div class="scroll">$regions</div>
<h2>Slopes</h2>
<p>A slope with its 95 % confidence interval, and what is expected of it.</p>
<div class="scroll">$slopes</div>
<h2>Cycles</h2>
$cycles
<h2>Pictures</h2>
<div class="row pictures">$pictures</div>
<h2>Checks</h2>
<div class="scroll">$checks</div>
<h2>Bounces and cutoff alone</h2>
<p>At $knob_samples samples, against the same samples with as good as nothing cut off. The error must not exceed the
residual of both x the brightest radiance, taken as $brightest, in any pixel. $bound</p>
<div class="scroll">$knobs</div>
<h2>What this scene does not need</h2>
<p>The plan of $shown, and what it left out.</p>
<div class="scroll">$plan</div>
<h2>All combinations</h2>
<div class="scroll">$all</div>
</body>
</html>
""")


def render(report: Report, pictures: Mapping[str, Float32]) -> str:
    """The whole page. pictures: caption -> (h, w, 3) linear, the first one without any error in its caption."""
    drawn = plots.draw(report)
    left_out = [f"left out: {entry['what']} ({entry['why']})" for entry in report["left_out"]]
    notes = [*report["notes"], *left_out, *([] if drawn else ["no plots: matplotlib is not installed"])]
    host, scene, reference = report["host"], report["scene"], report["reference"]
    parts = ", ".join(f"{part} {spent:.1f}" for part, spent in report["minutes"]["spent"].items())
    broken = any(e["beyond"] for e in report["knobs"]["entries"])
    return _PAGE.substitute(
        name=escape(scene["name"]),
        facts=escape(
            f"{scene['resolution'][0]} x {scene['resolution'][1]}, {scene['mask_pixels']:,} ray traced pixels, "
            f"{scene['triangles']:,} triangles, {scene['lights']} lights. "
            + ", ".join(f"{name} {value}" for name, value in host.items())
            + f". Version {report['version']}"
            + (f", commit {report['commit']}." if report["commit"] else ".")
            + f" Minutes: {parts}."
        ),
        summary=escape(summary(report)),
        plots="\n".join(
            f"<figure>{svg}<figcaption>{escape(text)}</figcaption></figure>" for text, svg in drawn.items()
        ),
        notes="".join(f"<p><b>Note:</b> {escape(note)}.</p>" for note in notes),
        reference=escape(
            f"{reference['samples']} other samples, {reference['max_depth']} bounces, cutoff {reference['cutoff']:g}; "
            f"its own noise {tables.cell(reference['floor']['all'][SHOWN])}"
        ),
        presets=tables.presets(report),
        best=tables.best(report),
        regions=tables.regions(report),
        slopes=tables.slopes(report),
        cycles=_cycles(report),
        pictures="".join(map(_picture, pictures, pictures.values())),
        checks=tables.checks(report),
        knob_samples=report["knobs"]["samples"],
        brightest=tables.cell(report["knobs"]["Lmax"]),
        bound='<b style="color: var(--bad)">It does in some.</b>' if broken else "It does in none.",
        knobs=tables.knobs(report),
        shown=escape(next(iter(pictures))),
        plan=tables.plan(report),
        all=tables.everything(report),
    )


def summary(report: Report) -> str:
    """What the page says, in a sentence or two."""
    slope, front = report["slopes"]["aa_all"], len(report["pareto"])
    text = f"{len(report['points'])} settings measured, "
    text += f"{front} of them on the front." if front else f"no front: {report['pareto_why']}."
    if slope["ci"] is not None:
        text += f" The error falls with samples to the power {slope['fit']:.2f} ± {slope['ci']:.2f}."
    for target in [e for e in report["cycles"]["equal_error"] if e["ratio"]][-1:]:
        text += (
            f" For RMSE {target[SHOWN]:.2g} Cycles takes {target['cycles']:.3g} s, the ray tracer "
            f"{target['ours']:.3g} s: Cycles / ray tracer {target['ratio']:.3g}."
        )
    return text


def _cycles(report: Report) -> str:
    cycles = report["cycles"]
    if "reference" not in cycles:
        return f"<p>{escape(cycles['why'])}</p>"
    r = cycles["reference"]
    text = (
        f"{cycles['how']}. Its reference has {r['samples']} samples ({r['seconds']:.3g} s), ours physical falloff of "
        f"lights; the mean radiance is {tables.cell(r['mean']['all'])}. What differs beyond the noise is the model: "
        "highlights, ambient light, shadows of glass, roughness of what the objects show."
    )
    return f'<p>{escape(text)}</p><div class="scroll">{tables.cycles(report)}</div>'


def _picture(caption: str, picture: Float32) -> str:
    data = base64.b64encode(png(picture)).decode("ascii")
    return (
        f'<figure><img alt="{escape(caption)}" src="data:image/png;base64,{data}">'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )
