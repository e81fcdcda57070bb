# SPDX-License-Identifier: GPL-3.0-or-later
"""Traced Shadows: what ray traced objects leave of the light on what EEVEE draws."""

from __future__ import annotations

from types import SimpleNamespace

import bpy
import numpy as np
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender.pipeline import scene_setup
from hybrid_addon.blender.render import images

pytestmark = [pytest.mark.blender, pytest.mark.render]


def ball(name, x, opacity):
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.6, location=(x, 0, 1.2))
    bpy.ops.object.shade_smooth()
    bpy.context.object.name = name
    hybrid.mark(bpy.context.object, opacity=opacity, reflectivity=0.0, ior=1.0)
    return bpy.context.object


@pytest.fixture(scope="module")
def rendered(addon):
    """Balls: opaque, dimming light by half at each face, and an opaque one in a ray traced collection instance."""
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    scene.render.resolution_x, scene.render.resolution_y, scene.eevee.taa_render_samples = 128, 64, 8
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 1.0
    bpy.ops.mesh.primitive_plane_add(size=12)
    lamp = bpy.data.objects["Light"]
    lamp.location, lamp.data.shadow_soft_size, lamp.data.energy = (0, 1.5, 4), 0.02, 500
    camera = scene.camera
    camera.location, camera.rotation_euler, camera.data.lens = (0, -9, 6), (0.95, 0, 0), 40
    ball("opaque", -2, 1.0)
    ball("clear", 0, 0.5)
    shown = bpy.data.collections.new("shown")
    shown.hybrid.ray_traced = True
    third = ball("third", 0, 1.0)
    third.hybrid.ray_traced = False
    third.users_collection[0].objects.unlink(third)
    shown.objects.link(third)
    empty = bpy.data.objects.new("instance", None)
    empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", shown, (2, 0, 0)
    scene.collection.objects.link(empty)
    scene.hybrid.passes = {"SHADOW"}
    scene_setup.enable(scene)
    r = SimpleNamespace()
    r.on = hybrid.render(scene, samples=4, traced_shadows=True)
    r.shadow = shadow_pass(scene)
    r.off = hybrid.render(scene, samples=4, traced_shadows=False)
    r.untouched = shadow_pass(scene)
    r.automatic = hybrid.render(scene, samples=4)
    r.visible = [b_object.visible_shadow for b_object in (*scene.objects, third)]
    r.bare = r.on.mask == 0
    return r


def shadow_pass(scene):
    planes = images.read_render_result(scene_setup.trace_scene(scene))
    return planes["Traced.Shadow"]


def test_the_raster_is_multiplied_where_there_is_shadow_and_exact_elsewhere(rendered):
    image, raster, shadow = (a[rendered.bare][:, :3] for a in (rendered.on.image, rendered.on.raster, rendered.shadow))
    lit = (shadow == 1).all(axis=1)
    assert 0.5 < lit.mean() < 0.95
    np.testing.assert_array_equal(image[lit], raster[lit])
    np.testing.assert_allclose(image, raster * shadow, rtol=1e-5)
    np.testing.assert_array_equal(rendered.on.image, rendered.on.raster + rendered.on.traced)
    np.testing.assert_array_equal(rendered.on.image[..., 3], rendered.off.image[..., 3])


def test_opaque_shadows_are_eevees_own(rendered):
    """Of the object and of the instance: drawn once, by the tracer as dark as by EEVEE."""
    for side in (slice(0, 48), slice(80, 128)):
        on, off, lit, shadow = columns(rendered, side)
        dark = shadow < 0.4
        assert np.count_nonzero(dark) > 100
        off_by = np.abs(on - off)[dark] / lit[dark]
        assert np.median(off_by) < 0.01  # of the light that the shadow takes away
        assert np.quantile(off_by, 0.8) < 0.02


def test_what_lets_light_through_casts_no_opaque_shadow(rendered):
    """A half clear face twice: a quarter of the lamp's light is left, more than EEVEE's shadow leaves."""
    on, off, lit, _ = columns(rendered, slice(48, 80))
    core = off < 0.25 * lit
    assert np.count_nonzero(core) > 100
    lamp = lit[core] - off[core]
    assert np.median((on[core] - off[core]) / lamp) == pytest.approx(0.25, abs=0.01)


def columns(r, side):
    """Red of both pictures, of the raster without shadows and of the shadow pass, off the ray traced objects."""
    bare = r.bare[:, side]
    return [a[:, side][bare][:, 0] for a in (r.on.image, r.off.image, r.on.raster, r.shadow)]


def test_switched_off_eevee_draws_the_shadows(rendered):
    assert (rendered.untouched == 1).all()
    np.testing.assert_array_equal(rendered.off.image[rendered.bare], rendered.off.raster[rendered.bare])
    assert rendered.off.report["settings"]["traced_shadows"] == "OFF"


def test_automatic_traces_them_where_something_is_clear(rendered):
    assert rendered.automatic.report["settings"]["traced_shadows"] == "AUTO"
    np.testing.assert_array_equal(rendered.automatic.image, rendered.on.image)


def test_nothing_of_the_scene_is_changed(rendered):
    assert all(rendered.visible)
    assert rendered.on.report["settings"]["traced_shadows"] == "ON"
    assert rendered.on.report["warnings"] == []
