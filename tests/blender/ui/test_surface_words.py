# SPDX-License-Identifier: GPL-3.0-or-later
"""A surface in a few words: true of numbers, of what is textured, and of what has only a volume."""

from __future__ import annotations

import pytest

from hybrid_addon.blender.ui.surface_words import described
from hybrid_addon.scene import Expression, Medium, Surface

pytestmark = pytest.mark.blender
TEXTURED = Expression("attribute", (), "normal")


@pytest.mark.parametrize(
    ("surface", "expected"),
    [
        (Surface(reflectivity=1.0, roughness=0.1), "Metal, Roughness 0.10"),
        (Surface(reflectivity=0.7, roughness=TEXTURED), "Metal, Reflectivity 0.70, Roughness textured"),
        (Surface(opacity=0.0, ior=1.5), "Glass, IOR 1.50, Roughness 0.50"),
        (Surface(opacity=0.4, ior=1.0), "Transparent, Opacity 0.40, IOR 1.00, Roughness 0.50"),
        (Surface(reflectivity=TEXTURED), "Textured, Reflectivity textured, Roughness 0.50"),
        (Surface(opacity=TEXTURED, ior=TEXTURED), "Textured, Opacity textured, IOR textured, Roughness 0.50"),
        (Surface(opacity=0.0, ior=1.0, fog=Medium()), "Volume"),
    ],
)
def test_words_are_true(surface, expected):
    assert list(described(surface)) == [expected]


def test_what_rays_do_not_change_is_told():
    first, second = described(Surface())
    assert first == "Solid, Roughness 0.50" and second.startswith("Neither mirror nor glass")
