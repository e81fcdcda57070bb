# SPDX-License-Identifier: GPL-3.0-or-later
"""The forty materials of tools/material_library: how many need no warning. Renders nothing."""

from __future__ import annotations

import pytest

import hybrid_addon
from tools.material_library import stage

pytestmark = pytest.mark.blender

AT_LEAST = 36
"""Materials without a warning."""


@pytest.fixture(scope="module")
def warnings():
    """{material: its warnings}, and what no material explains."""
    found, rest = {}, []
    for names in stage.groups():
        b_scene, _ = stage.build(names, 64)
        hybrid_addon.enable(b_scene)
        said = hybrid_addon.plan(b_scene)["warnings"]
        found |= {name: [warning for warning in said if f"'{name}'" in warning] for name in names}
        rest += [warning for warning in said if not any(f"'{name}'" in warning for name in names)]
    return found, rest


def test_there_are_forty():
    assert len(stage.MATERIALS) == 40


def test_most_are_traced_without_a_warning(warnings):
    found, rest = warnings
    clean = [name for name, said in found.items() if not said]
    print(*(f"{name}: {said}" for name, said in found.items() if said), sep="\n")
    assert len(clean) >= AT_LEAST
    assert rest == []
