# SPDX-License-Identifier: GPL-3.0-or-later
"""The tables of the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from ...presets import Quality
from .metrics import SHOWN, tells
from .regions import REGIONS
from .sweep import describe

Report = Mapping[str, Any]
Cells = Sequence[object]

SETTINGS = {"samples": "samples", "max_depth": "bounces", "cutoff": "cutoff", "adaptive": "adaptive",
            "rough_samples": "rough"}  # fmt: skip
ERRORS = {SHOWN: "RMSE shown", "flip_ldr": "FLIP", "rmse": "RMSE", "relmse_tev": "relMSE (tev)", "mae": "MAE",
          "bias": "bias", "p999": "p99.9", "max": "max", "nonfinite": "not finite"}  # fmt: skip
JUDGED = (SHOWN, "flip_ldr", "rmse")
TEXT = ' class="text"'
KNOBS = {"max_depth": "bounces", "cutoff": "cutoff", "seconds": "seconds", SHOWN: "RMSE shown", "rmse": "RMSE",
         "residual_mean": "residual mean", "residual_max": "residual max", "beyond": "pixels beyond it"}  # fmt: skip


def best(report: Report) -> str:
    """The front, the presets and Cycles, by time."""
    rows: list[tuple[float, Cells]] = []
    for i, p in enumerate(report["points"]):
        if i in report["pareto"] or p["preset"]:
            name = ", ".join([*(["front"] if i in report["pareto"] else []), *([p["preset"]] if p["preset"] else [])])
            time, cpu = p["time"]["trace"]["wall_med"], p["time"]["trace"]["cpu_med"]
            cells = (name, *_settings(p), p["seconds"], time, cpu, *_errors(p), p["bound"]["residual_max"], p["clear"])
            rows.append((p["seconds"], cells))
    for c in report["cycles"].get("points", []):
        time, none = c["time"], (None,) * 4
        rows.append((time["wall"], ("Cycles", c["samples"], *none, time["wall"], None, time["cpu"], *_errors(c), None,
                                    tells(c["error"]["all"]))))  # fmt: skip
    head = (
        "",
        *SETTINGS.values(),
        "seconds",
        "trace s",
        "cpu s",
        "RMSE shown",
        "FLIP",
        "RMSE",
        "residual max",
        "clear",
    )
    return table(head, [cells for _, cells in sorted(rows, key=lambda row: row[0])])


def presets(report: Report) -> str:
    """Whether each is on the front, by each metric."""
    rows = []
    for found in report["presets"]:
        for metric, verdict in found["by"].items():
            by = "" if verdict["beaten_by"] is None else name(report["points"][verdict["beaten_by"]])
            rows.append((found["preset"], ERRORS[metric], verdict["verdict"], by))
    return table(("preset", "by", "verdict", "what beats it"), rows)


def regions(report: Report) -> str:
    """Errors by region: of the reference itself, of the presets, of the front."""
    points, floor = report["points"], {"error": report["reference"]["floor"]}
    named = {i: p["preset"] for i, p in enumerate(points) if p["preset"]}
    rows = _by_region("the reference's own noise", floor)
    for i in sorted({*report["pareto"], *named}, key=lambda i: points[i]["seconds"]):
        rows += _by_region(f"{named[i]}: {name(points[i])}" if i in named else name(points[i]), points[i])
    return table(("setting", "region", "pixels", *ERRORS.values()), rows)


def slopes(report: Report) -> str:
    """Fitted, with its confidence interval, expected; or why there is none."""
    rows = [(name, s["fit"], s["ci"], s["expected"], s["why"]) for name, s in report["slopes"].items()]
    return table(("what", "fitted", "±", "expected", "why there is none"), rows)


def knobs(report: Report) -> str:
    """Bounces and cutoff alone."""
    return table(tuple(KNOBS.values()), [[e[key] for key in KNOBS] for e in report["knobs"]["entries"]])


def cycles(report: Report) -> str:
    """Our reference against Cycles', with the noise of that; Cycles' own points; times at equal error."""
    theirs = report["cycles"]
    reference = theirs["reference"]
    rows = [
        *_by_region("our reference minus Cycles'", {"error": reference["difference"]}),
        *_by_region("noise of Cycles' reference", {"error": reference["floor"]}),
    ]
    for point in theirs["points"]:
        rows += _by_region(f"Cycles, {point['samples']} samples", point)
    equal = [(e["samples"], e[SHOWN], e["cycles"], e["ours"], e["ratio"], e["why"]) for e in theirs["equal_error"]]
    head = ("Cycles' samples", "RMSE shown", "Cycles s", "ray tracer s", "Cycles / ray tracer", "why there is none")
    return table(("", "region", "pixels", *ERRORS.values()), rows) + "<p></p>" + table(head, equal)


def plan(report: Report) -> str:
    """Every pruning, and whether it applies; and what was left out of the picture below, how often."""
    rows = [(p["name"], p["applies"], p["class"], p["leaves_out"], p["when"]) for p in report["plan"]]
    skipped = [(entry["what"], entry["why"], entry["count"]) for entry in report["skipped"]]
    head = ("pruning", "applies", "class", "leaves out", "when")
    return table(head, rows) + "<p></p>" + table(("left out", "why", "how often"), skipped)


def checks(report: Report) -> str:
    """Counters that must be 0, and the audits of adaptive sampling."""
    rows = [(name.replace("_", " "), c["value"], c["tol"], c["pass"]) for name, c in report["invariants"].items()]
    counters = table(("must be 0: the most of any point", "value", "tolerance", "pass"), rows)
    audits = []
    for p in report["points"]:
        audit = p["sampling"].get("audit")
        if audit:
            part = (audit["left_alone"], audit["pixels"], audit["beyond"], audit["beyond_share_upper_95"])
            audits.append((name(p), p["sampling"]["samples_mean"], *part, audit["error_mean"], audit["error_max"]))
    head = ("adaptive sampling", "samples a pixel", "pixels left alone", "of these checked", "beyond the contrast",
            "at most so many are, 95 %", "mean error", "largest")  # fmt: skip
    return counters + ("<p></p>" + table(head, audits) if audits else "<p>No pixels were left alone.</p>")


def everything(report: Report) -> str:
    """Each point in a row."""
    head = (*SETTINGS.values(), "seconds", "runs", *(ERRORS[name] for name in JUDGED), "clear", "front")
    return table(head, [
        (*_settings(p), p["seconds"], p["time"]["trace"]["n"], *_errors(p), p["clear"], i in report["pareto"])
        for i, p in enumerate(report["points"])
    ])  # fmt: skip


def table(head: Cells, rows: Sequence[Cells]) -> str:
    """HTML; empty for no rows."""
    if not rows:
        return ""
    text = [any(isinstance(row[i], str) for row in rows) for i in range(len(head))]
    top = "".join(f"<th{TEXT * is_text}>{escape(str(name))}</th>" for name, is_text in zip(head, text, strict=True))
    body = "\n".join("<tr>" + "".join(map(_td, row)) + "</tr>" for row in rows)
    return f"<table><thead><tr>{top}</tr></thead><tbody>\n{body}\n</tbody></table>"


def cell(value: object) -> str:
    """As people read it."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.3g}"
    return f"{value:,}" if isinstance(value, int) else escape(str(value))


def _td(value: object) -> str:
    return f"<td{TEXT * isinstance(value, str)}>{cell(value)}</td>"


def _settings(point: Report) -> Cells:
    return tuple(point["settings"][name] for name in SETTINGS)


def _errors(point: Report) -> Cells:
    return tuple(point["error"]["all"][name] for name in JUDGED)


def name(point: Report) -> str:
    """A point's settings in words."""
    return describe(Quality(**point["settings"]))


def _by_region(name: str, point: Report) -> list[Cells]:
    found: list[Cells] = []
    for region in REGIONS:
        e = point["error"][region]
        found.append((name if region == REGIONS[0] else "", region, e["pixels"], *(e[key] for key in ERRORS)))
    return found
