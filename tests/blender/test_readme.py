"""README's tables are the properties' own descriptions: they cannot drift."""

from __future__ import annotations

from pathlib import Path

import bpy
import pytest

pytestmark = pytest.mark.blender
README = (Path(__file__).resolve().parents[2] / "README.md").read_text(encoding="utf-8")
HIDDEN = {"rna_type", "name", "restore", "threads"}


@pytest.mark.parametrize("owner", ["Object", "Scene"])
def test_every_property_is_in_readme_in_its_own_words(addon, owner):
    group = getattr(bpy.types, owner).bl_rna.properties["hybrid"].fixed_type
    shown = [p for p in group.properties if p.identifier not in HIDDEN]
    assert len(shown) >= 4
    for p in shown:
        assert f"| {p.name} | {p.description} |" in README
