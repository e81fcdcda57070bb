# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables of properties, presets and prunings; tests/blender/test_settings_page.py and test_plan.py compare."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from .blocks import ROOT

SETTINGS = ROOT / "docs" / "manual" / "settings.md"
PLAN = ROOT / "docs" / "reference" / "errors-and-plan.md"
OWNERS = ("Object", "Material", "Collection", "Scene")


def settings_blocks() -> dict[str, str]:
    """The blocks of the page of settings, from the registered add-on's own properties. Needs bpy."""
    from hybrid_addon.presets import QUALITY

    found = {owner.lower(): list(_properties(owner)) for owner in OWNERS}
    rows = {name: [_property_row(name, p) for p in properties] for name, properties in found.items()}
    tables = {name: _table(("Setting", "In Python", "Default", "Description"), rows[name]) for name in found}
    choices = [row for p in found["object"] + found["material"] + found["scene"] for row in _choice_rows(p)]
    tables["choices"] = _table(("Setting", "Choice", "In Python", "Description"), choices)
    heads = (
        "Preset",
        "Samples",
        "Noise Threshold",
        "Max Bounces",
        "Min Light",
        "Rough Samples",
        "Shadow Samples",
        "Use",
    )
    presets = [
        (label, q.samples, q.adaptive or "off", q.max_depth, _share(q.cutoff), q.rough_samples, q.shadow_samples, use)
        for label, use, q in QUALITY.values()
    ]
    tables["presets"] = _table(heads, presets)
    return tables


def plan_blocks() -> dict[str, str]:
    """The block of the page of errors and plan: every pruning. Needs no bpy."""
    from hybrid_addon.tracer.prepare.prunings import PRUNINGS

    rows = [(f"`{p.name}`", p.leaves_out, p.when, p.kind) for p in PRUNINGS]
    return {"plan": _table(("Name", "Leaves out", "When", "Class"), rows)}


def _properties(owner: str) -> Iterator[Any]:
    """Every property of `owner.hybrid` that an artist can see."""
    import bpy

    group = getattr(bpy.types, owner).bl_rna.properties["hybrid"].fixed_type
    yield from (p for p in group.properties if p.identifier not in ("rna_type", "name") and not p.is_hidden)


def _property_row(owner: str, p: Any) -> tuple[str, ...]:
    return p.name, f"`{owner}.hybrid.{p.identifier}`", _default(p), p.description


def _choice_rows(p: Any) -> Iterator[tuple[str, ...]]:
    if p.type == "ENUM":
        for item in p.enum_items:
            yield p.name, item.name, f'`"{item.identifier}"`', item.description


def _default(p: Any) -> str:
    """A property's default as the interface shows it."""
    if p.type == "BOOLEAN":
        return "on" if p.default else "off"
    if p.type == "ENUM":
        chosen = p.default_flag if p.is_enum_flag else {p.default}
        return ", ".join(item.name for item in p.enum_items if item.identifier in chosen) or "none"
    if p.type == "STRING":
        return p.default or "none"
    return f"{p.default:,}".replace(",", " ") if p.type == "INT" else f"{p.default:.3g}"


def _share(value: float) -> str:
    """1/64 for 0.015625, but 0.0001 as it is."""
    return f"1/{round(1 / value)}" if 1 / value < 1000 else f"{value:g}"


def _table(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(map(str, cells)) + " |" for cells in lines)
