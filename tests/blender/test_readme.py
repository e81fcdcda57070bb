"""README's tables are the properties' own descriptions: they cannot drift."""

from __future__ import annotations

from pathlib import Path

import bpy
import pytest

from hybrid_addon.presets import QUALITY

pytestmark = pytest.mark.blender
README = (Path(__file__).resolve().parents[2] / "README.md").read_text(encoding="utf-8")
HIDDEN = {"rna_type", "name", "restore", "memory", "version", "threads"}


@pytest.mark.parametrize("owner", ["Object", "Material", "Collection", "Scene"])
def test_every_property_is_in_readme_in_its_own_words(addon, owner):
    group = getattr(bpy.types, owner).bl_rna.properties["hybrid"].fixed_type
    shown = [p for p in group.properties if p.identifier not in HIDDEN]
    assert shown
    for p in shown:
        assert f"| {p.name} | {p.description} |" in README


def test_readme_has_the_values_of_the_presets():
    for label, tooltip, q in QUALITY.values():
        rows = [line for line in README.splitlines() if line.startswith(f"| {label} |")]
        assert len(rows) == 1
        cells = [cell.strip() for cell in rows[0].strip("|").split("|")]
        cutoff = 1 / float(cells[4][2:]) if "/" in cells[4] else float(cells[4])
        values = (int(cells[1]), 0.0 if cells[2] == "off" else float(cells[2]), int(cells[3]), cutoff)
        assert values == (q.samples, q.adaptive, q.max_depth, pytest.approx(q.cutoff))
        assert (int(cells[5]), int(cells[6]), cells[7]) == (q.rough_samples, q.shadow_samples, tooltip)
