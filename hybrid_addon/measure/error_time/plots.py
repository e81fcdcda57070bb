# SPDX-License-Identifier: GPL-3.0-or-later
"""The plots of the page, drawn by matplotlib as SVG; without it the page has tables only."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import Any

from .fits import pareto
from .metrics import SHOWN, tells

Report = Mapping[str, Any]

INK, SOFT, OURS, THEIRS, MARK = "#1b1f24", "#9aa1ab", "#1f6feb", "#d1650f", "#1a7f4b"
STYLE: Any = {"font.size": 8, "axes.spines.top": False, "axes.spines.right": False, "svg.fonttype": "none"}
SIZE = (5.6, 3.8)  # inches
PHASES = {
    "translate": "#c9a227", "build": "#d1650f", "intersect": OURS, "occluded": "#7fb2ff", "shade": SOFT,
    "develop": MARK, "composite": INK,
}  # fmt: skip


def draw(report: Report) -> dict[str, str]:
    """Each plot's caption and its <svg> element; none if matplotlib is not installed."""
    try:
        import matplotlib
        from matplotlib.figure import Figure
    except ImportError:
        return {}
    panels = {
        "Error against run time. Lower left is better; blue is the front that nothing clearly beats.": _time,
        "Error against samples, all paths followed, in three regions. Dashed: exponents -0.5 and -0.75.": _samples,
        "Error against bounces, and the bound that the residual gives.": _bounces,
        "Processor seconds by phase.": _phases,
    }
    drawn = {}
    with matplotlib.rc_context(STYLE):
        for caption, panel in panels.items():
            figure = Figure(figsize=SIZE, layout="constrained")
            panel(figure.add_subplot(), report)
            drawn[caption] = _svg(figure)
    return drawn


def _svg(figure: Any) -> str:
    file = io.StringIO()
    figure.savefig(file, format="svg", metadata={"Date": None})
    text = file.getvalue()
    return text[text.index("<svg") :]


def _time(axes: Any, report: Report) -> None:
    points, front = report["points"], report["pareto"]
    behind = [p for i, p in enumerate(points) if p["clear"] and i not in front]
    hidden = [p for p in points if not p["clear"]]
    drawn = [
        _curve(axes, _places(behind), "o", ms=3, color=SOFT, label="ray tracer"),
        _curve(axes, _places(hidden), "o", ms=3, color=SOFT, mfc="none", label="ray tracer, within the noise"),
        _curve(axes, _places([points[i] for i in front]), "o", ms=4, color=OURS, label=f"its front ({len(front)})"),
    ]
    line = _places([points[i] for i in front])
    best = pareto([x for x, _ in line], [y for _, y in line])
    _curve(axes, [line[i] for i in best], "-", lw=1, color=OURS)
    for p in points:
        for place in _places([p] if p["preset"] else []):
            axes.loglog(*place, "D", ms=7, mfc="none", color=MARK)
            axes.annotate(p["preset"], place, xytext=(6, 4), textcoords="offset points", color=MARK)
    cycles = report["cycles"].get("points", [])
    floor = report["cycles"]["reference"]["floor"]["all"][SHOWN] if cycles else None
    for name, clear, fill in (("Cycles", True, THEIRS), ("Cycles, within its noise", False, "none")):
        chosen = [(c["time"]["wall"], _shown(c)) for c in cycles if _shown(c) and tells(c["error"]["all"]) == clear]
        drawn.append(_curve(axes, chosen, "-s" if clear else "s", ms=4, color=THEIRS, mfc=fill, label=name))
    for c in cycles if any(drawn) else ():
        if _shown(c):
            place = (c["time"]["wall"], _shown(c))
            axes.annotate(str(c["samples"]), place, xytext=(4, 4), textcoords="offset points", color=THEIRS)
    if not any(drawn):
        _say(axes, "no setting has an error")
        return
    for level, color, whose in ((report["reference"]["floor"]["all"][SHOWN], SOFT, "our"), (floor, THEIRS, "Cycles'")):
        if level:
            axes.axhline(level, color=color, lw=0.8, ls=":", label=f"noise of {whose} reference")
    _label(axes, "seconds (translate, build, trace)", "RMSE of what is shown")


def _samples(axes: Any, report: Report) -> None:
    alone = [p for p in report["points"] if p["alone"]]
    colors, drawn = {"all": INK, "edges": OURS, "interior": MARK}, False
    for region, color in colors.items():
        pairs = sorted(
            (p["settings"]["samples"], p["error"][region][SHOWN], tells(p["error"][region]))
            for p in alone if p["error"][region][SHOWN]
        )  # fmt: skip
        fit = report["slopes"][f"aa_{region}"]["fit"]
        drawn |= _curve(axes, [(n, e) for n, e, clear in pairs if clear], "-o", ms=4, color=color,
                        label=region if fit is None else f"{region}: {fit:.2f}")  # fmt: skip
        drawn |= _curve(axes, [(n, e) for n, e, clear in pairs if not clear], "o", ms=4, color=color, mfc="none",
                        label=f"{region}, within the noise")  # fmt: skip
        if region == "all" and len(pairs) > 1:
            n, e, _ = pairs[0]
            for power in (-0.5, -0.75):
                axes.loglog([n, pairs[-1][0]], [e, e * (pairs[-1][0] / n) ** power], "--", lw=0.8, color=SOFT)
    if drawn:
        _label(axes, "samples", "RMSE of what is shown")
    else:
        _say(axes, "no setting has an error")


def _bounces(axes: Any, report: Report) -> None:
    entries = report["knobs"]["entries"]
    least = min((e["cutoff"] for e in entries), default=0.0)
    series = [e for e in entries if e["cutoff"] == least]
    brightest, drawn = report["knobs"]["Lmax"], False
    for key, scale, name, color in (
        ("rmse", 1.0, "RMSE", OURS),
        ("residual_mean", brightest, "bound, mean over pixels", MARK),
        ("residual_max", brightest, "bound, largest", SOFT),
    ):
        pairs = [(e["max_depth"], e[key] * scale) for e in series if e[key] * scale > 0]
        drawn |= _curve(axes, pairs, "-o", ms=4, color=color, label=name)
    if drawn:
        axes.set_xscale("log", base=2)
        axes.xaxis.set_major_formatter("{x:g}")
        _label(axes, "bounces", "radiance")
    else:
        _say(axes, "nothing is cut off at any number of bounces" if series else "there was no time to measure it")


def _phases(axes: Any, report: Report) -> None:
    named = [p for p in report["points"] if p["preset"]]
    if not named:
        _say(axes, "no preset was measured")
        return
    rows = [{phase: seconds for phase, seconds in _seconds_by_phase(p, report).items() if seconds} for p in named]
    whole, left = [sum(row.values()) or 1.0 for row in rows], [0.0] * len(named)
    for phase, color in PHASES.items():
        width = [100 * row.get(phase, 0.0) / of for row, of in zip(rows, whole, strict=True)]
        if any(width):
            axes.barh(range(len(named)), width, left=left, color=color, label=phase)
            left = [a + w for a, w in zip(left, width, strict=True)]
    axes.set_yticks(range(len(named)), [f"{p['preset']}\n{of:.2g} s" for p, of in zip(named, whole, strict=True)])
    axes.invert_yaxis()
    axes.set_xlabel("% of the processor time, EEVEE's apart")
    if any(left):
        axes.legend(frameon=False, loc="upper center", bbox_to_anchor=(0.5, 1.2), ncols=4)


def _seconds_by_phase(point: Report, report: Report) -> dict[str, float]:
    """Processor seconds: what every render spends, and what this one spent on tracing."""
    shared, own = report["time"], point["time"]
    return {
        phase: shared[phase]["cpu"] if phase in shared else own[phase]["cpu_med"] if phase in own else 0.0
        for phase in PHASES
    }


def _curve(axes: Any, pairs: Sequence[tuple[float, float]], *style: Any, **more: Any) -> bool:
    """Draw (x, y) on logarithmic axes; False if there is nothing to draw."""
    if pairs:
        axes.loglog(*zip(*pairs, strict=True), *style, **more)
    return bool(pairs)


def _say(axes: Any, text: str) -> None:
    axes.set_axis_off()
    axes.text(0.5, 0.5, text, ha="center", transform=axes.transAxes)


def _label(axes: Any, x: str, y: str) -> None:
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(color="#eceff2", lw=0.6)
    axes.legend(frameon=False)


def _shown(point: Report) -> float:
    return float(point["error"]["all"][SHOWN] or 0.0)


def _places(points: Sequence[Report]) -> list[tuple[float, float]]:
    """Where points are drawn: logarithmic axes have no place for an error of 0."""
    return [(p["seconds"], _shown(p)) for p in points if _shown(p)]
