# SPDX-License-Identifier: GPL-3.0-or-later
"""The viewport's preview without a window: its camera, its colours, its work. With one: tests/real_blender."""

from __future__ import annotations

import time
from contextlib import nullcontext
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender import preview, session
from hybrid_addon.blender.preview import icon, tint
from hybrid_addon.blender.preview import view as view_module
from hybrid_addon.blender.preview.display import Display
from hybrid_addon.blender.preview.draw import far_to_near, seen_part
from hybrid_addon.blender.preview.job import Job
from hybrid_addon.blender.preview.reproject import surface_of
from hybrid_addon.blender.preview.view import View
from hybrid_addon.blender.render import images
from hybrid_addon.blender.render.settings import preview_settings
from hybrid_addon.blender.sync import Warnings, translate
from hybrid_addon.blender.sync.camera import translate_camera
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.core.camera import project

pytestmark = pytest.mark.blender

SIZE = (101, 67)


def view_through_camera(scene, size=SIZE):
    """What a viewport of this size would show whose frame is the camera's."""
    b_depsgraph = bpy.context.evaluated_depsgraph_get()
    b_camera = scene.camera
    projection = b_camera.calc_matrix_camera(b_depsgraph, x=size[0], y=size[1])
    return View(
        tuple(tuple(row) for row in b_camera.matrix_world),
        tuple(tuple(row) for row in projection),
        size,
        (0, 0, *size),
        (b_camera.data.clip_start, b_camera.data.clip_end),
    )


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
def test_a_view_is_seen_as_the_camera_with_its_projection(scene, kind):
    scene.camera.data.type = kind
    scene.camera.data.shift_x, scene.camera.data.shift_y = 0.3, -0.2
    own = translate_camera(bpy.context.evaluated_depsgraph_get(), scene, SIZE, (0, 0, *SIZE), Warnings())
    camera = view_through_camera(scene).camera(1)
    assert camera.projection == own.projection and camera.resolution == own.resolution and camera.window == own.window
    np.testing.assert_allclose(camera.view_plane, own.view_plane, rtol=2e-6, atol=1e-6)
    np.testing.assert_allclose(camera.matrix_world, own.matrix_world, atol=1e-6)


def test_coarse_pixels_are_blocks_of_fine_ones(scene):
    """101 x 67 pixels are 13 x 9 blocks of 8, the last of which reach beyond the region."""
    fine, coarse = (view_through_camera(scene).camera(step) for step in (1, 8))
    assert coarse.resolution == (13, 9) and coarse.window == (0, 0, 13, 9)
    pixel = (fine.view_plane[1] - fine.view_plane[0]) / SIZE[0]
    block = (coarse.view_plane[1] - coarse.view_plane[0]) / 13
    assert block == pytest.approx(8 * pixel, rel=1e-6)
    assert coarse.view_plane[0] == fine.view_plane[0] and coarse.view_plane[2] == fine.view_plane[2]


@pytest.mark.parametrize(("transform", "look"), [("AgX", "AgX - Punchy"), ("Filmic", "None"), ("Standard", "None")])
def test_colours_are_those_that_blender_saves(scene, tmp_path, transform, look):
    """Against Image.save_render, within a step of 8 bits and the rounding of Blender's table of AgX."""
    scene.view_settings.view_transform = transform
    scene.view_settings.look = look
    scene.view_settings.exposure, scene.view_settings.gamma = 0.5, 1.2
    rng = np.random.default_rng(1)
    radiance = (rng.uniform(0, 1, (16, 16, 3)) ** 3 * 8).astype(np.float32)
    b_image = bpy.data.images.new("radiance", 16, 16, float_buffer=True)
    b_image.pixels.foreach_set(np.dstack([radiance, np.ones((16, 16), np.float32)]).ravel())
    with images.image_settings(scene, "IMAGE", "PNG", "8"):
        b_image.save_render(str(tmp_path / "saved.png"), scene=scene)
    saved = bpy.data.images.load(str(tmp_path / "saved.png"))
    saved.colorspace_settings.name = "Non-Color"
    values = np.empty(16 * 16 * 4, np.float32)
    saved.pixels.foreach_get(values)
    np.testing.assert_allclose(Display.of(scene).encode(radiance), values.reshape(16, 16, 4)[..., :3], atol=1.5 / 255)


@pytest.mark.parametrize(("transform", "most"), [("AgX", 6), ("Filmic", 6), ("Standard", 0.5)])
def test_colours_by_table_are_those_of_the_transform(scene, monkeypatch, transform, most):
    """From 2^-12 to 1000 in each channel, whatever exposure and gamma; most: of 255. The transform is built once."""
    scene.view_settings.view_transform, scene.view_settings.look = transform, "None"
    scene.view_settings.exposure, scene.view_settings.gamma = 0.5, 1.2
    radiance = np.exp2(np.random.default_rng(1).uniform(-12, 9, (64, 64, 3))).astype(np.float32)
    display = Display.of(scene)
    exact, found = display.encode(radiance), display.encode_by_table(radiance)
    difference = np.abs(found - exact).max(axis=2) * 255
    assert np.percentile(difference, 99) < min(most, 2) and difference.max() < most
    monkeypatch.setattr(Display, "encode", None)
    np.testing.assert_array_equal(display.encode_by_table(radiance[:1]), found[:1])
    strange = np.array([[[np.nan, -1.0, 1.0], [np.inf, 1e9, 5000.0]]], np.float32)
    np.testing.assert_array_equal(
        display.encode_by_table(strange), display.encode_by_table(np.clip(np.nan_to_num(strange), 0, 1023.0))
    )


def translated(scene, view):
    scene.hybrid.samples = 4
    bpy.data.objects["Cube"].hybrid.ray_traced = True
    b_depsgraph = bpy.context.evaluated_depsgraph_get()
    return translate(b_depsgraph, scene, (1, 1), (0, 0, 1, 1), camera=view.camera(1)).scene


def finish(job):
    deadline = time.perf_counter() + 300  # so that a job that hangs is a failure; none comes near it
    while not job.done:
        assert time.perf_counter() < deadline
        time.sleep(0.01)


def test_the_last_picture_is_what_a_render_traces(scene):
    view = view_through_camera(scene)
    ours = translated(scene, view)
    settings = preview_settings(scene)
    job = Job(ours, view, settings, Display.of(scene), budget=20.0)
    finish(job)
    picture = job.take_picture()
    assert job.problem == "" and picture.label == "4/4"
    film = trace(ours, settings)
    x0, y0, x1, y1 = picture.rect
    np.testing.assert_array_equal(picture.pixels[..., 3], film.coverage[y0:y1, x0:x1])
    assert film.coverage.sum() == pytest.approx(picture.pixels[..., 3].sum())
    assert picture.pixels[..., :3].max() > 0.1
    # What it showed is the cube, whose faces are 1 from its middle; what is a ring wider is as deep.
    assert np.median(np.abs(np.abs(job.surface.points).max(axis=1) - 1)) < 0.4 and job.surface.points.flags.c_contiguous
    assert np.isclose(np.abs(job.surface.points).max(axis=1), 1, atol=1e-3).mean() > 0.3


def test_a_dropped_job_ends_soon(scene):
    view = view_through_camera(scene, (1920, 1080))
    scene.hybrid.samples = 4
    job = Job(translated(scene, view), view, preview_settings(scene), Display.of(scene), budget=60.0)
    job.join()
    picture = job.take_picture()
    assert job.done and (picture is None or picture.label != "4/4")  # it was not waited for


def test_a_job_says_what_it_cannot_trace(scene):
    view = view_through_camera(scene)
    broken = translated(scene, view)
    object.__setattr__(broken.surfaces[0], "ior", -1.0)
    job = Job(broken, view, preview_settings(scene), Display.of(scene), budget=1.0)
    finish(job)
    assert "ior" in job.problem and job.take_picture() is None


def test_the_render_region_bounds_the_preview(monkeypatch):
    """Ctrl B: the scene's border within the camera's frame, cut where the region ends; elsewhere the viewport's own."""
    region, box = SimpleNamespace(width=200, height=100), (0.25, 0.5, 0.75, 1.0)
    names = ("min_x", "min_y", "max_x", "max_y")
    border = dict(zip([f"border_{n}" for n in names], box, strict=True))
    scene = SimpleNamespace(render=SimpleNamespace(use_border=True, **border))
    own = dict(zip([f"render_border_{n}" for n in names], (0.1, 0.2, 0.3, 0.4), strict=True))
    space = SimpleNamespace(region_3d=None, use_render_border=True, **own)
    monkeypatch.setattr(view_module, "_frame", lambda *_: (-100.0, 20.0, 300.0, 120.0))
    assert view_module._rect(region, space, object(), scene) == (0, 70, 200, 100)
    assert view_module._rect(region, space, None, scene) == (20, 20, 60, 40)
    scene.render.use_border = space.use_render_border = False
    assert view_module._rect(region, space, object(), scene) == (0, 20, 200, 100)
    assert view_module._rect(region, space, None, scene) == (0, 0, 200, 100)


def test_f12_of_a_render_region_keeps_to_the_time_budget(scene):
    """What Render Region in the Image Editor sets: that part alone, as good as the budget allows."""
    scene.render.resolution_x, scene.render.resolution_y, scene.render.use_border = 256, 192, True
    scene.render.border_min_x, scene.render.border_max_x = 0.25, 0.75
    scene.render.border_min_y, scene.render.border_max_y = 0.5, 1.0
    hybrid.mark(bpy.data.objects["Cube"], opacity=0.0)
    report = hybrid.render(scene, mode="full", samples=65536, time_budget=1.5).report
    frame = session.of(scene.name).frame
    assert frame.window == (64, 96, 192, 192) and frame.mask.shape == (96, 128)
    assert any(entry["what"] == "samples" and "time budget" in entry["why"] for entry in report["skipped"])


def test_what_a_view_showed_lies_where_it_was_met(scene):
    """The mesh of a moved picture: places that the old view shows at their pixels, on a plane of known depth."""
    for kind in ("PERSP", "ORTHO"):
        scene.camera.data.type = kind
        camera = view_through_camera(scene, (64, 48)).camera(8)
        depth, coverage = np.full((6, 8), 1e10, np.float32), np.zeros((6, 8), np.float32)
        depth[2:4, 3:6], coverage[2:4, 3:6] = 5, 1
        surface = surface_of(camera, depth, coverage, 8)
        assert len(surface.points) == 4 * 5 and len(surface.triangles) == 2 * 3 * 4  # a ring wider
        back = project(camera, surface.points.T.astype(np.float64))
        np.testing.assert_allclose(np.stack(back[:2], axis=1) * 8, surface.pixels, atol=1e-3)
        np.testing.assert_allclose(back[2], 5, rtol=1e-6)
    assert surface_of(camera, depth, coverage * 0, 8) is None


def test_only_what_a_viewport_shows_is_translated(scene):
    view = view_through_camera(scene)
    b_depsgraph = bpy.context.evaluated_depsgraph_get()
    whole, one = (
        translate(b_depsgraph, scene, (1, 1), (0, 0, 1, 1), camera=view.camera(1), shown=shown).scene
        for shown in (None, frozenset({"Cube"}))
    )
    assert [instance.name for instance in one.instances] == ["Cube"] and not one.lights
    assert len(whole.instances) >= 1 and len(whole.lights) == 1


def test_the_icon_is_premultiplied_and_no_square():
    pixels = icon.pixels()
    assert pixels.shape == (icon.SIZE, icon.SIZE, 4) and (pixels[..., :3] <= pixels[..., 3:] + 1e-6).all()
    assert (pixels[[0, -1]][:, [0, -1]] == 0).all() and 0.2 < pixels[..., 3].mean() < 0.8


def test_a_preview_that_cannot_be_says_so_once(scene, monkeypatch):
    """The viewport is drawn again, without the picture of before, and nothing is tried until something changes."""
    drawn, tried = [], []
    area = SimpleNamespace(tag_redraw=lambda: drawn.append(1))
    context = SimpleNamespace(scene=scene, temp_override=lambda **_: nullcontext())

    def refuse(*_args):
        tried.append(1)
        raise MemoryError

    monkeypatch.setattr(preview, "_translate", refuse)
    monkeypatch.setattr(preview, "bpy", SimpleNamespace(context=context))
    viewport = preview._Viewport(view_through_camera(scene), None, 0.0, 0, moved=object())
    assert not any(preview._attend(viewport, None, area, None) for _ in range(3))
    assert len(drawn) == len(tried) == 1
    assert viewport.moved is None and viewport.problem == "not enough memory for the preview"


def test_what_has_moved_is_drawn_from_far_to_near_and_read_back_where_it_lies():
    """Two quads one before the other, seen along -z by a camera at the origin of 90 degrees."""
    square = np.float32([(-1, -1), (1, -1), (1, 1)])
    points = np.concatenate([np.column_stack([square, np.full(3, -z)]) for z in (2, 8, 4)]).astype(np.float32)
    triangles = np.arange(9, dtype=np.int32).reshape(3, 3)
    view = np.array([(1, 0, 0, 0), (0, 1, 0, 0), (0, 0, -1.002, -0.2), (0, 0, -1, 0)], np.float64)
    assert far_to_near(points, triangles, view).tolist() == [1, 2, 0]
    assert seen_part(points, view, (100, 60)) == (25, 15, 75, 45)
    assert seen_part(points + np.float32((0, 0, 5)), view, (100, 60)) == (0, 0, 100, 60)  # some are behind the eye
    flat = np.diag([0.1, 0.1, -0.02, 1.0])  # orthographic
    assert far_to_near(points, triangles, flat).tolist() == [1, 2, 0]


def test_what_is_ray_traced_has_a_color_instances_too(scene, monkeypatch):
    monkeypatch.setattr(tint, "_batch", lambda name, _b_object: name[0])
    scene.objects["Cube"].hybrid.ray_traced = True
    shown = bpy.data.collections.new("Shown")
    shown.objects.link(bpy.data.objects.new("Inner", bpy.data.objects["Cube"].data))
    shown.hybrid.ray_traced = True
    empty = bpy.data.objects.new("Empty", None)
    empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", shown, (3, 0, 0)
    scene.collection.objects.link(empty)
    bpy.context.view_layer.update()
    context = SimpleNamespace(scene=scene, evaluated_depsgraph_get=bpy.context.evaluated_depsgraph_get)
    found = {name: tuple(matrix.translation) for name, matrix in tint._placed(context, None)}
    assert found == {"Cube": (0, 0, 0), "Inner": (3, 0, 0)}
    assert [name for name, _ in tint._placed(context, frozenset({"Empty"}))] == ["Inner"]  # local view
    scene.objects["Cube"].hybrid.ray_traced = False
    scene.objects["Cube"].active_material.hybrid.ray_traced = True  # a material by itself: its faces
    asked = []
    monkeypatch.setattr(tint, "_batch", lambda name, _b_object: asked.append(name))
    tint._placed(context, None)
    assert ("Cube", "Cube", (0,)) in asked and ("Inner", "Cube", None) in asked
