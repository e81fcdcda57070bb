# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders with EEVEE through Blender's own pipeline, once for each scene; the tests assert facts on shared pictures."""

from __future__ import annotations

from types import SimpleNamespace

import bpy
import numpy as np
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender.pipeline import compositor_setup, scene_setup
from hybrid_addon.blender.render import images

pytestmark = [pytest.mark.blender, pytest.mark.render]

HALF = 2.0**-10  # EEVEE's film is half float: 11 bits of a number near 1
SNAP = (
    0.013  # EEVEE's film rounds an alpha above 0.995 up to 1 after each sample (eevee_film, "Fix alpha ..."), so that
)
# the outermost pixels of an outline lose up to this much coverage


def build():
    """A mirror cube and a glass sphere on a floor under a bright sky."""
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y, scene.eevee.taa_render_samples = 96, 72, 4
    scene.eevee.use_shadows = False  # most of the time of software OpenGL
    bpy.ops.mesh.primitive_plane_add(size=30, location=(0, 0, -1))
    bpy.ops.mesh.primitive_uv_sphere_add(radius=1, location=(2.2, -1.5, 0))
    sphere = bpy.context.object
    bpy.ops.object.shade_smooth()
    sphere.name = "Glass"
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (4, 4, 4, 1)
    hybrid.mark(bpy.data.objects["Cube"], reflectivity=1.0)
    hybrid.mark(sphere, reflectivity=0.0, opacity=0.0, ior=1.5)
    scene.hybrid.traced_shadows, scene.hybrid.adaptive = "OFF", 0.0  # the raster stays what EEVEE made it
    hybrid.enable(scene)
    return scene


@pytest.fixture(scope="module")
def renders(addon):
    """Every picture that the tests below look at."""
    r = SimpleNamespace()
    scene = build()
    keep = dict(samples=4)
    r.hybrid = hybrid.render(scene, **keep)
    r.again = hybrid.render(scene, threads=1, **keep)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(compositor_setup, "needs_source", lambda *_: True)
        r.both_layers = hybrid.render(scene, **keep)
        r.source_was_drawn = scene_setup.source_layer(scene).use
    r.raster = hybrid.render(scene, mode="raster")
    r.full = hybrid.render(scene, mode="full", **keep)
    scene.render.film_transparent = True
    r.transparent = hybrid.render(scene, **keep)
    scene.render.film_transparent = False
    scene.render.use_border = True
    scene.render.border_min_x, scene.render.border_max_x = 0.3, 0.8
    scene.render.border_min_y, scene.render.border_max_y = 0.2, 0.71
    r.border = hybrid.render(scene, **keep)
    scene.render.use_crop_to_border = True
    r.crop = hybrid.render(scene, **keep)
    scene.render.use_border = scene.render.use_crop_to_border = False
    for name in ("Cube", "Glass"):
        bpy.data.objects[name].location.y += 1000
    r.away = hybrid.render(scene, **keep)
    r.away_raster = hybrid.render(scene, mode="raster")
    for name in ("Cube", "Glass"):
        hybrid.unmark(bpy.data.objects[name])
    r.unflagged = hybrid.render(scene, **keep)
    bpy.data.objects["Plane"].hide_render = True
    glow_sphere()
    r.outline = hybrid.render(scene, **keep)
    return r


GLOW, SKY = 0.5, 4.0


def glow_sphere():
    """A ray traced sphere of one radiance, so that the right colour of each edge pixel is known in closed form."""
    bpy.ops.mesh.primitive_uv_sphere_add(radius=1.5)
    material = bpy.data.materials.new("Glow")
    material.use_nodes = True
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (0, 0, 0, 1)
    shader.inputs["Specular IOR Level"].default_value = 0
    shader.inputs["Emission Color"].default_value = (GLOW, GLOW, GLOW, 1)
    shader.inputs["Emission Strength"].default_value = 1
    bpy.context.object.data.materials.append(material)
    hybrid.mark(bpy.context.object)


def test_composite_is_the_sum_to_the_last_bit(renders):
    for result in (renders.hybrid, renders.transparent, renders.border, renders.crop):
        np.testing.assert_array_equal(result.image, result.raster + result.traced)


def test_raster_alpha_and_mask_sum_to_one(renders):
    assert 0.05 < renders.hybrid.mask.mean() < 0.5
    np.testing.assert_allclose(renders.hybrid.raster[..., 3] + renders.hybrid.mask, 1, atol=HALF)


def test_transparent_film_gives_the_same_mask(renders):
    np.testing.assert_allclose(renders.transparent.mask, renders.hybrid.mask, atol=0.01)
    floor = np.abs(renders.transparent.image[..., 3] - renders.raster.image[..., 3])
    assert floor[: floor.shape[0] // 2].max() < 0.01  # opaque where floor and objects are


def test_raster_is_untouched_where_the_mask_is_0(renders):
    outside = renders.hybrid.mask == 0
    assert outside.any()
    np.testing.assert_array_equal(renders.hybrid.image[outside], renders.hybrid.raster[outside])
    assert not renders.hybrid.traced[outside].any()


def test_traced_alpha_is_the_mask(renders):
    np.testing.assert_array_equal(renders.hybrid.traced[..., 3], renders.hybrid.mask)


def test_the_same_again(renders):
    np.testing.assert_array_equal(renders.again.image, renders.hybrid.image)


def test_without_the_users_own_layer_it_is_the_same_exact(renders):
    """The mask layer gives raster and mask: EEVEE draws once instead of twice."""
    assert renders.source_was_drawn
    for name in ("image", "raster", "mask", "traced"):
        np.testing.assert_array_equal(getattr(renders.both_layers, name), getattr(renders.hybrid, name))


def test_full_mode_draws_every_pixel_without_eevee(renders):
    assert (renders.full.mask == 1).all()
    assert not renders.full.raster.any()
    inside = renders.hybrid.mask == 1
    full, hybrid = renders.full.image[inside], renders.hybrid.image[inside]
    # In pixels that EEVEE finds full a sample of ours may still pass the object by, and shows what is behind it.
    assert (full == hybrid).all(axis=-1).mean() > 0.99
    np.testing.assert_allclose(full, hybrid, rtol=1e-3)


def test_raster_mode_is_eevee_alone(renders):
    assert not renders.raster.mask.any()
    outside = renders.hybrid.mask == 0
    difference = np.abs(renders.raster.image[outside] - renders.hybrid.image[outside]).max(axis=-1)
    # EEVEE's screen-space ambient occlusion sees a held-out object a little differently, close to where it stands.
    assert (difference == 0).mean() > 0.95
    assert difference.max() < 0.05 * SKY


def test_border_is_a_window_of_the_full_frame(renders):
    """Blender truncates in single precision: .3 x 96 = 28, .8 x 96 = 76, .2 x 72 = 14, .71 x 72 = 51."""
    assert renders.border.image.shape == renders.hybrid.image.shape
    window = np.s_[14:51, 28:76]
    assert renders.crop.image.shape == (37, 48, 4)
    inside = renders.hybrid.mask[window] == 1
    assert inside.mean() > 0.2
    for part in (renders.border.image[window], renders.crop.image):
        np.testing.assert_array_equal(part[inside], renders.hybrid.image[window][inside])
    outside = renders.border.image.copy()
    outside[window] = 0
    assert not outside.any()


def test_no_fringe_along_outlines(renders):
    """Over the bright sky every edge pixel is the sky times 1 - m plus the object times m, never outside both.

    A lerp of two finished pictures, a mask of another filter, or masked pixels that no ray hit leave a line here.
    """
    image, mask = renders.outline.image[..., :3], renders.outline.mask
    edge = (mask > 0) & (mask < 1)
    assert edge.sum() > 100
    assert image.min() >= GLOW - 1 / 255
    assert image.max() <= SKY + 1 / 255
    expected = SKY * (1 - mask) + GLOW * mask
    np.testing.assert_allclose(image, np.repeat(expected[..., None], 3, axis=-1), atol=SKY * SNAP)
    traced = renders.outline.traced[..., :3][edge]
    np.testing.assert_allclose(traced, np.broadcast_to(mask[edge, None] * GLOW, traced.shape), rtol=1e-5)


def test_flagged_objects_out_of_view_leave_the_raster_bit_exact(renders):
    assert not renders.away.mask.any()
    np.testing.assert_array_equal(renders.away.image, renders.away_raster.image)
    assert sum(renders.away.report["rays"].values()) == 0


def test_nothing_flagged_costs_nothing(renders):
    np.testing.assert_array_equal(renders.unflagged.image, renders.away_raster.image)
    assert not renders.unflagged.mask.any()
    assert "no object is ray traced" in renders.unflagged.report["warnings"][0]


def test_the_report_says_what_was_done(renders):
    report = renders.hybrid.report
    assert report["resolution"] == [96, 72]
    assert report["mask_pixels"] == np.count_nonzero(renders.hybrid.mask)
    assert {"raster", "mask read", "translate", "build", "intersect", "occluded", "shade", "composite", "total"} <= set(
        report["time"]
    )
    assert set(report["rays"]) >= {"camera", "reflected", "refracted", "shadow", "dropped"}
    assert not any(report["invariants"].values()), report["invariants"]
    assert {"blender", "python", "numpy", "embree"} <= set(report["versions"])


def test_nothing_is_left_behind(addon):
    scene = build()
    image = scene.render.image_settings
    image.file_format = "JPEG"
    before = (image.file_format, image.color_mode, image.quality, scene.frame_current, scene.hybrid.mode)
    hybrid.disable(scene)
    hybrid.render(scene, mode="full", samples=1, frame=7, resolution=(32, 24))
    after = (image.file_format, image.color_mode, image.quality, scene.frame_current, scene.hybrid.mode)
    assert after == before
    assert scene_setup.mask_layer(scene) is None
    assert scene_setup.trace_scene(scene) is None


def test_exr_round_trip(tmp_path):
    pixels = np.random.default_rng(1).normal(size=(5, 7, 4)).astype(np.float32)
    images.write_exr(tmp_path / "x.exr", pixels)
    (read,) = images.read_exr(tmp_path / "x.exr").values()
    np.testing.assert_array_equal(read, pixels)
