# SPDX-License-Identifier: GPL-3.0-or-later
"""A pixel's ray tree from Blender: objects and materials by their names, bad pixels refused."""

from __future__ import annotations

import bpy
import pytest

import hybrid_addon as hybrid

pytestmark = pytest.mark.blender


@pytest.fixture
def glass(scene):
    scene.render.resolution_x, scene.render.resolution_y = 96, 54
    hybrid.mark(bpy.data.objects["Cube"], reflectivity=0.0, opacity=0.0, ior=1.5)
    return scene


def test_a_pixel_of_glass_is_told_by_its_rays(glass):
    lines = hybrid.explain(48, 27, glass).splitlines()
    assert lines[0].startswith("pixel 48, 27: radiance ")
    assert lines[1].startswith("camera 100 %: ") and "'Cube'" in lines[1] and "from outside" in lines[1]
    assert lines[2].startswith("├ reflected ") and any("└ refracted " in line for line in lines)


def test_a_pixel_of_the_background_is_eevees(glass):
    assert "EEVEE draws it" in hybrid.explain(0, 0, glass)


def test_a_pixel_outside_is_refused(glass):
    with pytest.raises(hybrid.HybridError, match="outside the frame of 96 x 54"):
        hybrid.explain(96, 0, glass)
