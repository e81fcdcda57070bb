# SPDX-License-Identifier: GPL-3.0-or-later
"""A dozen of the balls of `make balls`, one for each way that a surface answers light: hybrid, EEVEE and Cycles."""

from __future__ import annotations

import pytest

from tools.ball_table import pictures, rows, stage

pytestmark = [pytest.mark.blender, pytest.mark.render]

DOZEN = {
    "Principled, Base Color": rows.RED,
    "Principled, Metallic": 1.0,
    "Principled, Coat Tint": rows.RED,
    "Principled, Sheen Tint": rows.WHITE,
    "Principled, Subsurface Radius": (0.3, 0.3, 0.3),
    "Translucent, Color": rows.WHITE,
    "Principled, Emission Color": rows.RED,
    "Metallic, Anisotropy": 0.5,
    "Metallic, Thin Film Thickness": 400.0,
    "Glass, Roughness": 0.2,
    "Transparent, Color": rows.RED,
    "Add, Diffuse and": "glossy",
}


@pytest.fixture(scope="module")
def balls(addon):
    """The rows of those that this version of Blender has."""
    return pictures.compared(*stage.build(lambda label, value: label in DOZEN and DOZEN[label] == value))


def test_each_ball_is_near_eevee_or_cycles(balls):
    assert len(balls) >= len(DOZEN) - 1  # Metallic's film is of 5.0
    print(*balls, sep="\n")
    assert [row for row in balls if row.nearer > pictures.WITHIN or row.warned] == []


def test_reasons_are_of_rows_that_there_are():
    assert rows.WHY.keys() <= stage.rows().keys()
