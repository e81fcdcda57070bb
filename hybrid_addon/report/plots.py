"""The plots of the page, drawn by matplotlib as SVG; without it the page has tables only."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import Any

Report = Mapping[str, Any]

INK, SOFT, OURS, THEIRS, MARK = "#1b1f24", "#9aa1ab", "#1f6feb", "#d1650f", "#1a7f4b"
STYLE: Any = {"font.size": 8, "axes.spines.top": False, "axes.spines.right": False, "svg.fonttype": "none"}
SIZE = (5.6, 3.8)  # inches


def draw(report: Report) -> dict[str, str]:
    """Each plot's caption and its <svg> element; none if matplotlib is not installed."""
    try:
        import matplotlib
        from matplotlib.figure import Figure
    except ImportError:
        return {}
    panels = {
        "Error against run time. Lower left is better; the line is the front that nothing beats.": _time,
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
    points, front = report["points"], set(report["pareto"])
    shown = [p for p in points if _rmse(p)]
    best = [points[i] for i in report["pareto"] if _rmse(points[i])]
    axes.loglog(_seconds(shown), list(map(_rmse, shown)), "o", ms=3, color=SOFT, label="ray tracer")
    axes.loglog(_seconds(best), list(map(_rmse, best)), "-o", ms=4, color=OURS, label=f"its front ({len(front)})")
    for p in points:
        if p["preset"] and _rmse(p):
            axes.loglog([p["seconds"]], [_rmse(p)], "D", ms=7, mfc="none", color=MARK)
            axes.annotate(p["preset"], (p["seconds"], _rmse(p)), xytext=(6, 4), textcoords="offset points", color=MARK)
    cycles = report["cycles"].get("points", [])
    if cycles:
        axes.loglog(
            [c["time"]["wall"] for c in cycles], [c["rmse"] for c in cycles], "-s", ms=4, color=THEIRS, label="Cycles"
        )
        for c in cycles:
            place = (c["time"]["wall"], c["rmse"])
            axes.annotate(str(c["samples"]), place, xytext=(4, 4), textcoords="offset points", color=THEIRS)
    floor = report["reference"]["floor_rmse"]["all"]
    if floor:
        axes.axhline(3 * floor, color=SOFT, lw=0.8, ls=":", label="3 x noise of the reference")
    _label(axes, "seconds (translate, build, trace)", "RMSE")


def _samples(axes: Any, report: Report) -> None:
    alone = [p for p in report["points"] if p["alone"]]
    colors = {"all": INK, "edges": OURS, "interior": MARK}
    for region, color in colors.items():
        pairs = [(p["settings"]["samples"], p["error"][region]["rmse"]) for p in alone if p["error"][region]["rmse"]]
        if not pairs:
            continue
        slope = report["slopes"].get(f"aa_{region}")
        name = f"{region}: {slope['fit']:.2f}" if slope else region
        axes.loglog(*zip(*pairs, strict=True), "-o", ms=4, color=color, label=name)
        if region == "all":
            n, e = pairs[0]
            for power in (-0.5, -0.75):
                axes.loglog([n, pairs[-1][0]], [e, e * (pairs[-1][0] / n) ** power], "--", lw=0.8, color=SOFT)
    _label(axes, "samples", "RMSE")


def _bounces(axes: Any, report: Report) -> None:
    entries = report["knobs"]["entries"]
    least = min(e["cutoff"] for e in entries)
    series = [e for e in entries if e["cutoff"] == least]
    brightest = report["knobs"]["Lmax"]
    for key, scale, name, color in (
        ("rmse", 1.0, "RMSE", OURS),
        ("residual_mean", brightest, "bound, mean over pixels", MARK),
        ("residual_max", brightest, "bound, largest", SOFT),
    ):
        pairs = [(e["max_depth"], e[key] * scale) for e in series if e[key] > 0]
        if pairs:
            axes.semilogy(*zip(*pairs, strict=True), "-o", ms=4, color=color, label=name)
    if any(e["rmse"] > 0 or e["residual_max"] > 0 for e in series):
        _label(axes, "bounces", "radiance")
    else:
        axes.set_axis_off()
        axes.text(0.5, 0.5, "nothing is cut off at any number of bounces", ha="center", transform=axes.transAxes)


def _phases(axes: Any, report: Report) -> None:
    named = [p for p in report["points"] if p["preset"]]
    left = [0.0] * len(named)
    rows = list(range(len(named)))
    for phase, color in (("intersect", OURS), ("occluded", "#7fb2ff"), ("shade", SOFT)):
        width = [p["time"][phase]["cpu_med"] for p in named]
        axes.barh(rows, [_share(w, p) for w, p in zip(width, named, strict=True)], left=left, color=color, label=phase)
        left = [a + _share(w, p) for a, w, p in zip(left, width, named, strict=True)]
    labels = [f"{p['preset']}\n{p['time']['trace']['cpu_med']:.2g} s" for p in named]
    axes.set_yticks(rows, labels)
    axes.invert_yaxis()
    axes.set_xlabel("% of the processor time of tracing")
    axes.legend(frameon=False, loc="upper center", bbox_to_anchor=(0.5, 1.12), ncols=3)


def _share(seconds: float, point: Report) -> float:
    phases = ("intersect", "occluded", "shade")
    whole: float = sum(point["time"][phase]["cpu_med"] for phase in phases)
    return 100 * seconds / whole if whole else 0.0


def _label(axes: Any, x: str, y: str) -> None:
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(color="#eceff2", lw=0.6)
    axes.legend(frameon=False)


def _rmse(point: Report) -> float:
    return float(point["error"]["all"]["rmse"] or 0.0)


def _seconds(points: Sequence[Report]) -> list[float]:
    return [p["seconds"] for p in points]
