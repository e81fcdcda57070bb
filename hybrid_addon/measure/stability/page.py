# SPDX-License-Identifier: GPL-3.0-or-later
"""The page: one self-contained HTML file, readable on a screen and on paper, with pictures as data: URIs."""

from __future__ import annotations

import base64
import math
import os
import tempfile
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from string import Template

import numpy as np

from ...scene import Float32
from .case import Case, Result
from .table import SITUATIONS

Results = Sequence[tuple[Case, Result]]
DECADES = (-17, 1)
"""The strip beside a value shows it and its tolerance between 10^-17 and 10."""

STRIP_WIDTH = 140

_PAGE = Template("""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Stability: $summary</title>
<style>
:root { --ink: #1b1f24; --soft: #69707a; --line: #dde1e6; --good: #1a7f4b; --bad: #c2261d; --wash: #f6f7f9; }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 2.2rem 1.5rem 4rem; max-width: 78rem; color: var(--ink); background: #fff;
       font: 14px/1.45 system-ui, -apple-system, "Segoe UI", "Liberation Sans", Arial, sans-serif; }
h1 { font-size: 1.6rem; margin: 0 0 .2rem; }
h2 { font-size: 1.1rem; margin: 2.2rem 0 .5rem; }
p { max-width: 56rem; margin: .3rem 0; }
.soft, small { color: var(--soft); }
.summary { font-size: 1.1rem; margin: .6rem 0; }
.good { color: var(--good); } .bad { color: var(--bad); }
table { border-collapse: collapse; width: 100%; }
th { text-align: left; font-weight: 600; font-size: .8rem; color: var(--soft); border-bottom: 1px solid var(--ink); }
td { border-bottom: 1px solid var(--line); vertical-align: top; }
th, td { padding: .35rem .6rem .35rem 0; }
.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
.overview { width: auto; min-width: 34rem; }
.cases { table-layout: fixed; }
.cases td.what b { font-weight: 600; }
code { font: 12px/1.4 ui-monospace, "DejaVu Sans Mono", Consolas, monospace; overflow-wrap: anywhere; }
.mark { font-weight: 700; white-space: nowrap; }
tr.failed td { background: #fdf1f0; }
.limits { border: 1px solid var(--bad); border-radius: 4px; padding: .6rem 1rem; margin: 1rem 0; background: #fdf1f0; }
.limits ul { margin: .3rem 0; padding-left: 1.2rem; }
img { display: block; height: 96px; max-width: 240px; object-fit: contain; object-position: left;
      image-rendering: pixelated; margin: .35rem 0 .1rem; border: 1px solid var(--line); }
svg { display: block; margin-top: .2rem; }
a { color: inherit; }
@media print {
  body { font-size: 8.5pt; padding: 0; max-width: none; }
  h2 { break-after: avoid; } tr { break-inside: avoid; } thead { display: table-header-group; }
}
</style>
</head>
<body>
<h1>Stability: stiff and extreme cases</h1>
<p class="summary"><b class="$tone">$summary</b> in $seconds s.
<span class="soft">$versions</span></p>
<p>Every case is a number with a tolerance, measured by tracing small scenes; it passes if the number is finite and not
above the tolerance. A tolerance of 0 means that nothing at all may differ. Radiance is linear, with a largest value of
about 1. The strip shows the <b>value</b> (dot) and its <b>tolerance</b> (tick) on a logarithmic scale from 1e-17 to 10;
the number in the first column is that of the situation, of which there are $situations.</p>
$limits
<h2>Overview</h2>
<table class="overview">
<thead><tr><th>Theme</th><th class="n">cases</th><th class="n">passed</th><th class="n">tolerance 0</th>
<th class="n">seconds</th></tr></thead>
<tbody>
$overview
</tbody>
</table>
$themes
</body>
</html>
""")

_THEME = Template("""<h2 id="$anchor">$title <small>$passed of $count</small></h2>
<table class="cases">
<colgroup><col style="width:4%"><col style="width:38%"><col style="width:24%"><col style="width:14%">
<col style="width:9%"><col style="width:5%"><col style="width:6%"></colgroup>
<thead><tr><th>#</th><th>Case</th><th>Right answer</th><th>Value</th><th>Tolerance</th><th class="n">s</th>
<th></th></tr>
</thead>
<tbody>
$rows
</tbody>
</table>""")

_ROW = Template("""<tr class="$state" id="$name">
<td class="soft" title="$situation">$number</td>
<td class="what"><b>$what</b><br><code class="soft">$name</code>$detail$picture</td>
<td>$answer</td>
<td><code>$value</code> <small>$unit</small>$strip</td>
<td><code>$tolerance</code></td>
<td class="n soft">$seconds</td>
<td class="mark $tone">$mark</td>
</tr>""")


def render(results: Results, versions: Mapping[str, str]) -> str:
    """The whole page."""
    failed = [(case, result) for case, result in results if not result.passed]
    titles = list(dict.fromkeys(case.theme for case, _ in results))
    groups = {title: [(c, r) for c, r in results if c.theme == title] for title in titles}
    return _PAGE.substitute(
        summary=escape(summary(results)),
        tone="bad" if failed else "good",
        seconds=f"{sum(result.seconds for _, result in results):.0f}",
        versions=escape(", ".join(f"{name} {version}" for name, version in versions.items())),
        situations=len(SITUATIONS),
        limits=_limits(failed),
        overview="\n".join(_overview(title, group) for title, group in groups.items()),
        themes="\n".join(_theme(title, group) for title, group in groups.items()),
    )


def summary(results: Results) -> str:
    """How many cases passed."""
    passed = sum(result.passed for _, result in results)
    return f"{passed} of {len(results)} cases pass"


def line(case: Case, result: Result) -> str:
    """One line for a terminal."""
    mark = "pass" if result.passed else "FAIL"
    value = f"{_number(result.value):>9} (tolerance {case.tolerance:g}) {case.unit}"
    return f"{mark}  {case.number:2d}  {case.name:<44} {value}"


def _limits(failed: Results) -> str:
    if not failed:
        return ""
    items = "\n".join(
        f'<li><a href="#{escape(case.name)}"><code>{escape(case.name)}</code></a>: {_number(result.value)} against '
        f"{case.tolerance:g}</li>"
        for case, result in failed
    )
    return f'<div class="limits"><b class="bad">Not within tolerance</b>\n<ul>\n{items}\n</ul></div>'


def _overview(title: str, group: Results) -> str:
    passed = sum(result.passed for _, result in group)
    exact = sum(result.passed and case.tolerance == 0 for case, result in group)
    tone = "good" if passed == len(group) else "bad"
    return (
        f'<tr><td><a href="#{_anchor(title)}">{escape(title)}</a></td><td class="n">{len(group)}</td>'
        f'<td class="n {tone}">{passed}</td><td class="n">{exact}</td>'
        f'<td class="n">{sum(result.seconds for _, result in group):.1f}</td></tr>'
    )


def _theme(title: str, group: Results) -> str:
    return _THEME.substitute(
        anchor=_anchor(title),
        title=escape(title),
        passed=sum(result.passed for _, result in group),
        count=len(group),
        rows="\n".join(_row(case, result) for case, result in group),
    )


def _anchor(title: str) -> str:
    return "".join(c if c.isalnum() else "-" for c in title.lower())


def _row(case: Case, result: Result) -> str:
    detail = "" if not result.detail else f"<br><small>{escape(result.detail)}</small>"
    picture = ""
    if result.picture is not None:
        data = base64.b64encode(png(result.picture)).decode("ascii")
        picture = f'<img alt="picture of {escape(case.name)}" src="data:image/png;base64,{data}">'
    return _ROW.substitute(
        state="" if result.passed else "failed",
        number=case.number,
        situation=escape(SITUATIONS.get(case.number, "")),
        what=escape(case.what),
        name=escape(case.name),
        detail=detail,
        picture=picture,
        answer=escape(case.answer),
        value=_number(result.value),
        unit=escape(case.unit),
        strip=_strip(result.value, case.tolerance),
        tolerance=f"{case.tolerance:g}",
        seconds=f"{result.seconds:.2f}",
        tone="good" if result.passed else "bad",
        mark="pass" if result.passed else "FAIL",
    )


def _number(value: float) -> str:
    """Short: two digits are what one reads."""
    if not math.isfinite(value):
        return "none"
    return f"{value:.0f}" if float(value).is_integer() and abs(value) < 1e6 else f"{value:.2g}"


def _strip(value: float, tolerance: float) -> str:
    """Value and tolerance on a logarithmic scale; nothing where the answer is exact."""
    if tolerance <= 0 or not math.isfinite(value):
        return ""

    def place(number: float) -> float:
        low, high = DECADES
        decade = math.log10(number) if number > 0 else low
        return STRIP_WIDTH * (min(max(decade, low), high) - low) / (high - low)

    color = "#1a7f4b" if value <= tolerance else "#c2261d"
    x, limit = place(value), place(tolerance)
    return (
        f'<svg width="{STRIP_WIDTH + 8}" height="12" viewBox="-4 0 {STRIP_WIDTH + 8} 12" role="img" '
        f'aria-label="value and tolerance"><line x1="0" x2="{STRIP_WIDTH}" y1="6" y2="6" stroke="#dde1e6"/>'
        f'<line x1="{x:.1f}" x2="{limit:.1f}" y1="6" y2="6" stroke="{color}" stroke-opacity=".35" stroke-width="3"/>'
        f'<line x1="{limit:.1f}" x2="{limit:.1f}" y1="1" y2="11" stroke="#1b1f24" stroke-width="1.5"/>'
        f'<circle cx="{x:.1f}" cy="6" r="3" fill="{color}"/></svg>'
    )


def display(picture: Float32) -> np.ndarray:
    """(h, w, 3) linear to 8 bits: clipped to 0..1, the sRGB curve (IEC 61966-2-1); NaN is black."""
    c = np.clip(np.nan_to_num(picture.astype(np.float64)), 0, 1)
    curve = np.where(c <= 0.0031308, 12.92 * c, 1.055 * c ** (1 / 2.4) - 0.055)
    return np.asarray(np.round(curve * 255), np.uint8)


def png(picture: Float32) -> bytes:
    """A picture (h, w, 3), linear, bottom row first, as the bytes of a PNG file."""
    import OpenImageIO as oiio

    pixels = np.ascontiguousarray(display(picture)[::-1])
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, "uint8")
    with tempfile.TemporaryDirectory(prefix="hybrid_") as folder:
        path = os.path.join(folder, "picture.png")
        output = oiio.ImageOutput.create(path)
        if not (output and output.open(path, spec) and output.write_image(pixels) and output.close()):
            raise RuntimeError(f"cannot write a PNG file: {output.geterror() if output else oiio.geterror()}")
        return Path(path).read_bytes()
