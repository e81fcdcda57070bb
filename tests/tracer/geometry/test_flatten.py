# SPDX-License-Identifier: GPL-3.0-or-later
"""Flags of primitives: those of their object, and those of what they wear."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import Instance, Surface
from hybrid_addon.tracer.geometry import instanced
from hybrid_addon.tracer.geometry.flatten import flatten


@pytest.mark.parametrize("many", [1, 3])
def test_what_wears_a_ray_traced_surface_is_ray_traced(build, many, monkeypatch):
    """Slot by slot, flattened and as instances that share a mesh; the rest of the object is not."""
    for limit in ("LEAST_INSTANCED", "INSTANCING_FROM"):
        monkeypatch.setattr(instanced, limit, 1)
    box = build.box()
    box = replace(box, surface_slots=(np.arange(len(box.triangles)) % 2).astype(np.int32))
    scene = build.scene(surfaces=(Surface(), Surface(ray_traced=True)))
    boxes = [Instance(f"{i}", 0, np.eye(4) + i * np.eye(4, k=3), (0, 1)) for i in range(many)]
    g = flatten(replace(scene, meshes=(box,), instances=tuple(boxes)), [{}, {}], apart=np.zeros(2, bool))
    assert (g.ray_traced == (g.surface == 1)).all() and 0.4 < g.ray_traced.mean() < 0.6
    assert (g.instanced is not None) == (many > 1)
