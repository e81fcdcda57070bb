"""EEVEE's picture and depth as the tracer gets them."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

import hybrid_addon as hybrid
from hybrid_addon import tracer
from hybrid_addon.blender import layers, pipeline
from hybrid_addon.tracer.constants import NO_DEPTH

pytestmark = [pytest.mark.blender, pytest.mark.render]


def test_the_tracer_gets_eevees_picture_and_depth_where_it_asks_for_them(scene, monkeypatch):
    bpy.ops.mesh.primitive_plane_add(size=30, location=(0, 0, -1))
    hybrid.mark(bpy.data.objects["Cube"], reflectivity=1.0)
    got, trace = [], tracer.trace
    monkeypatch.setattr(tracer, "trace", lambda scene, *rest: got.append(scene) or trace(scene, *rest))
    monkeypatch.setattr(pipeline, "needs_raster", lambda _: True)
    scene.eevee.taa_render_samples = 4
    hybrid.enable(scene)
    result = hybrid.render(scene, samples=1, resolution=(64, 48))
    camera, raster = got[0].camera, got[0].raster
    np.testing.assert_array_equal(raster.pixels, result.raster)
    # The floor, in closed form: where the rays through the pixels' centres meet z = -1.
    x, y = np.meshgrid((np.arange(64) + 0.5) / 64, (np.arange(48) + 0.5) / 48)
    left, right, bottom, top = camera.view_plane
    down = camera.matrix_world[2, :3] @ np.stack([left + x * (right - left), bottom + y * (top - bottom), -x / x], 1)
    floor = -(camera.matrix_world[2, 3] + 1) / down
    shows_floor = (raster.pixels[..., 3] == 1) & (raster.depth < NO_DEPTH)
    assert shows_floor.mean() > 0.3
    off = np.abs(raster.depth / floor - 1)[shows_floor]
    assert np.quantile(off, 0.99) < 0.02
    sky = raster.depth[raster.depth > 60]
    assert len(sky) > 0
    assert (sky == np.float32(NO_DEPTH)).all()

    monkeypatch.undo()
    pipeline.sync(scene)
    assert not layers.mask_layer(scene).use_pass_z
