# SPDX-License-Identifier: GPL-3.0-or-later
"""The Image Editor's tools without a window: which pixel a click means, what it is told, what the insets look like."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from hybrid_addon.blender import session
from hybrid_addon.blender.errors import HybridError
from hybrid_addon.blender.preview.display import Display
from hybrid_addon.blender.render import growing
from hybrid_addon.blender.session import Frame
from hybrid_addon.blender.ui.image_editor import editor_panels, insets, picker, slots

sys.path.insert(0, str(Path(__file__).parent))
from test_panels import labels, seen, words_of

pytestmark = pytest.mark.blender


@pytest.fixture
def frame(scene):
    b_render = scene.render
    b_render.resolution_x, b_render.resolution_y, b_render.resolution_percentage = 192, 108, 50
    b_render.border_min_x, b_render.border_max_x, b_render.border_min_y, b_render.border_max_y = 0.25, 0.75, 0.5, 1.0
    return scene


def test_a_click_means_a_pixel_of_the_frame_at_its_resolution(frame):
    assert picker.pixel_at(frame, 0.0, 0.0) == (0, 0)
    assert picker.pixel_at(frame, 0.999, 0.999) == (95, 53)
    frame.render.use_border = True  # the rest of the picture is empty, and still there
    assert picker.pixel_at(frame, 0.999, 0.999) == (95, 53)
    frame.render.resolution_x, frame.render.resolution_percentage = 100, 29
    assert picker.pixel_at(frame, 0.999, 0.999) == (28, 30)


def test_a_picture_cropped_to_the_border_is_a_part_of_the_frame(frame):
    frame.render.use_border = frame.render.use_crop_to_border = True
    assert picker.pixel_at(frame, 0.0, 0.0) == (24, 27)
    assert picker.pixel_at(frame, 0.999, 0.999) == (71, 53)


@pytest.mark.parametrize("place", [(-0.01, 0.5), (0.5, 1.0)])
def test_a_click_beside_the_picture_is_refused(frame, place):
    with pytest.raises(HybridError, match="within the picture"):
        picker.pixel_at(frame, *place)


def test_what_cannot_be_explained_is_refused_in_one_line(scene):
    assert picker.refusal(scene) == "Hybrid is off in this scene"
    assert not bpy.ops.hybrid.explain_pixel.poll()
    scene.hybrid.enabled = True
    assert picker.refusal(scene) == ""
    scene.render.use_multiview = True
    assert "switch Stereoscopy off" in picker.refusal(scene)
    scene.camera = None
    assert "has no camera" in picker.refusal(scene)


def test_the_answer_is_a_text_that_the_next_one_replaces(frame):
    frame.hybrid.enabled = True
    bpy.data.objects["Cube"].hybrid.ray_traced = True
    for x, y in ((0, 0), (48, 27)):
        assert bpy.ops.hybrid.explain_pixel(x=x, y=y) == {"FINISHED"}
        assert bpy.data.texts[picker.TEXT].as_string().startswith(f"pixel {x}, {y}: ")
    assert "to 'Cube'" in bpy.data.texts[picker.TEXT].as_string()
    with pytest.raises(RuntimeError, match="outside the frame of 96 x 54"):
        bpy.ops.hybrid.explain_pixel(x=96, y=0)


def test_the_answer_stands_in_the_sidebar_until_the_picture_is_another(frame):
    frame.hybrid.enabled = True
    bpy.data.objects["Cube"].hybrid.ray_traced = True
    bpy.ops.hybrid.explain_pixel(x=48, y=27)
    answer = picker.answered(frame)
    assert (answer.x, answer.y) == (48, 27) and "to 'Cube'" in answer.lines[1]
    recorder = labels.Layout()
    editor_panels.HYBRID_IMAGE_PT_pixel.draw(SimpleNamespace(layout=recorder), seen(frame))
    words = " ".join(words_of(recorder))
    assert words.startswith("Pixel 48, 27: radiance") and "light" in words
    frame.render.resolution_x = 64
    assert picker.answered(frame) is None


def rendered(of, value):
    """A frame of 2 x 1 pixels."""
    traced = np.full((1, 2, 4), value, np.float32)
    return Frame((0, 0, 2, 1), None, np.ones((1, 2), np.float32), traced, {"value": value}, of=of)


def test_each_slot_of_the_render_result_keeps_its_halves(scene, monkeypatch):
    own, of = session.of(scene.name), growing.frame_of(scene)
    for slot, value in ((0, 0.25), (1, 1e9)):
        own.begin_frame(slot)
        own.deliver(rendered(of, value), "View Layer")
    for slot, value in ((0, 0.25), (1, 1e9)):
        monkeypatch.setattr(slots, "active", lambda slot=slot: slot)
        found = slots.frame_shown(scene)
        assert found.report["value"] == value and found.traced[0, 0, 0] == np.float32(value)
        assert insets.part(found, Display.of(scene), "TRACED").dtype == np.float32
    monkeypatch.setattr(slots, "active", lambda: 0)
    own.begin_frame(2)
    assert np.isfinite(own.kept[1].traced).all()  # in half precision
    own.begin_frame(0)  # EEVEE alone, or stopped: what was there is gone
    assert slots.frame_shown(scene) is None and own.frame_in(1) is not None
    own.deliver(rendered((1, 2, 3), 0.5), "View Layer")  # of another size
    assert slots.frame_shown(scene) is None


def test_a_wipe_shows_the_left_part_of_what_is_chosen(scene, monkeypatch):
    quads, place = [], [0.0]
    monkeypatch.setattr(insets, "_drawn", insets._Drawn())
    monkeypatch.setattr(insets, "_rectangle", lambda *_: (10, 0, 110, 50))
    monkeypatch.setattr(insets, "_label", lambda *_: None)
    monkeypatch.setattr(insets.wipe, "place", lambda _context: place[0])
    monkeypatch.setattr(insets, "_quad", lambda *made: quads.append(made) or SimpleNamespace(draw=lambda _size: None))
    system = SimpleNamespace(system=SimpleNamespace(ui_scale=1))
    context = SimpleNamespace(scene=scene, region=SimpleNamespace(width=200, height=50), preferences=system)
    scene.hybrid.shown, scene.hybrid.compare_slot = "SLOT", 2
    monkeypatch.setattr(slots._read, "slot", 1)
    monkeypatch.setattr(slots._read, "pixels", np.zeros((2, 4, 4), np.float32))
    for place[0] in (5.0, 60.0, 500.0):
        insets._draw_whole(context, None)
    assert [pixels.shape[1] for pixels, _ in quads] == [2, 4]
    assert [box for _, box in quads] == [(10, 0, 60.0, 50), (10, 0, 110.0, 50)]


def test_why_another_slot_is_not_shown(scene, monkeypatch):
    assert slots.problem(scene) == ""
    scene.hybrid.shown, scene.hybrid.compare_slot = "SLOT", 3
    monkeypatch.setattr(slots, "active", lambda: 2)
    assert "choose another" in slots.problem(scene)
    scene.hybrid.compare_slot = 5
    slots.read(scene)
    assert slots.problem(scene) and slots.other_picture(scene) is None
    slots.forget()


def test_insets_are_small_means_of_mask_and_traced_half(scene):
    """A picture of 1000 x 600, half of it covered by grey: blocks of 4 x 4."""
    mask = np.zeros((600, 1000), np.float32)
    mask[:, 500:] = 1
    mask[0, 500] = 0
    traced = np.where(mask[..., None] > 0, np.float32([0.18, 0.18, 0.18, 1]), np.float32(0))
    scene.view_settings.view_transform = "Standard"
    shown = insets.pictures(Frame((0, 0, 1000, 600), None, mask, traced, {}), Display.of(scene))
    assert {name: picture.shape for name, picture in shown.items()} == {
        "Mask": (150, 250, 4),
        "Traced": (150, 250, 4),
    }
    assert (shown["Mask"][..., 3] == 1).all()
    np.testing.assert_allclose(shown["Mask"][0, 124:127, 0], [0, 15 / 16, 1], atol=1e-6)
    assert shown["Traced"][9, 9, 0] == 0
    assert shown["Traced"][9, 200, 0] == pytest.approx(1.055 * 0.18 ** (1 / 2.4) - 0.055, abs=2e-3)


def test_a_part_in_full_size_has_every_pixel(scene):
    mask = np.linspace(0, 1, 6, dtype=np.float32).reshape(2, 3)
    traced = np.dstack([mask, 0 * mask, 0 * mask, mask])
    frame = Frame((0, 0, 3, 2), None, mask, traced, {})
    scene.view_settings.view_transform = "Standard"
    display = Display.of(scene)
    np.testing.assert_array_equal(insets.part(frame, display, "MASK")[..., 1], mask)
    shown = insets.part(frame, display, "TRACED")
    assert shown.shape == (2, 3, 4) and (shown[..., 3] == 1).all()
    assert (np.diff(shown[..., 0].ravel()) > 0).all() and shown[1, 2, :3] == pytest.approx([1, 0, 0], abs=1e-3)
    assert insets.part(frame, display, "RASTER") is None  # mode Full has none


def test_a_frame_at_the_address_of_one_that_is_gone_is_another(scene, monkeypatch):
    quads = []
    monkeypatch.setattr(insets, "_drawn", insets._Drawn())
    monkeypatch.setattr(insets, "_rectangle", lambda *_: (0, 0, 2, 1))
    monkeypatch.setattr(insets.wipe, "place", lambda _context: 2.0)
    monkeypatch.setattr(insets, "_label", lambda *_: None)
    monkeypatch.setattr(insets, "_quad", lambda *made: quads.append(made) or SimpleNamespace(draw=lambda _size: None))
    scene.hybrid.shown = "MASK"
    system = SimpleNamespace(system=SimpleNamespace(ui_scale=1))
    context = SimpleNamespace(scene=scene, region=SimpleNamespace(width=2, height=1), preferences=system)
    for gray in (0.25, 0.5, 0.75):  # each is gone when the next is made, which so gets its address
        frame = Frame((0, 0, 2, 1), None, np.full((1, 2), gray, np.float32), np.zeros((1, 2, 4), np.float32), {})
        insets._draw_whole(context, frame)
        insets._draw_whole(context, frame)
        del frame
    assert [pixels[0, 0, 0] for pixels, _ in quads] == [0.25, 0.5, 0.75]
