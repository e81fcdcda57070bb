# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture of a render while it grows, without a window. With one: tests/real_blender/escape.py."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from hybrid_addon.blender import session
from hybrid_addon.blender.render import growing
from hybrid_addon.blender.ui.image_editor import insets

pytestmark = pytest.mark.blender


@pytest.fixture
def clock(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(growing.time, "perf_counter", lambda: now[0])
    return now


def test_a_picture_grows_from_eevees_half_about_once_a_second(scene, clock):
    own, window = session.of(scene.name), (0, 0, 4, 2)
    own.begin_frame()
    grows = growing.Growing(scene, window)
    assert own.so_far.picture is None and own.so_far.window == window
    raster, mask = np.full((2, 4, 4), 0.25, np.float32), np.zeros((2, 4), np.float32)
    mask[0], raster[0] = 1, 0
    grows.begins_with(raster, mask)
    np.testing.assert_array_equal(own.so_far.picture, raster[..., :3])
    made = []

    def make(step):
        made.append(clock[0])
        return np.full((2, 4, 3), len(made), np.float32)

    for clock[0] in (100.1, 100.5, 101.0, 101.2, 102.3):
        grows.show(make)
    assert made == [100.1, 101.2, 102.3]
    np.testing.assert_array_equal(own.so_far.picture[0], 3)  # where the mask is, the traced half
    np.testing.assert_array_equal(own.so_far.picture[1], 0.25)


def test_the_first_traced_picture_is_not_waited_for(scene, clock):
    """A look at nothing costs no second of what comes next."""
    grows, made = growing.Growing(scene, (0, 0, 4, 2)), []

    def make(step):
        made.append(clock[0])
        return np.full((2, 4, 3), clock[0] > 100.2, np.float32)

    for clock[0] in (100.0, 100.1, 100.3, 100.9, 101.4):
        grows.show(make)
    assert made == [100.0, 100.3, 101.4]


def test_it_says_how_far_it_is_and_how_long_it_takes(scene, clock):
    own = session.of(scene.name)
    grows = growing.Growing(scene, (0, 0, 4, 2))
    assert grows.told("Tracing", 0.1) == ""  # nothing is known of its speed yet
    clock[0] += 10
    assert grows.told("Tracing", 0.25) == ", about 30 s left"
    assert own.so_far.text == "Tracing 25 %, about 30 s left" and own.so_far.fraction == 0.25
    assert [growing.duration(s) for s in (0.2, 89, 240, 9000)] == ["1 s", "89 s", "4 min", "2.5 h"]


def test_esc_keeps_what_there_is_and_a_failure_does_not(scene, clock):
    own = session.of(scene.name)
    grows = growing.Growing(scene, (0, 0, 4, 2))
    grows.begins_with(np.ones((2, 4, 4), np.float32), np.ones((2, 4), np.float32))
    grows.told("Tracing", 0.5)
    growing.stopped(scene)
    assert own.so_far.picture is not None and own.so_far.text == "Stopped at 50 %"
    assert own.so_far.fraction is None
    own.fail(ValueError("no"))
    assert own.so_far is None and str(own.error) == "no"
    grows = growing.Growing(scene, (0, 0, 4, 2))
    grows.told("Building", 0.0)
    growing.stopped(scene)  # before there is a picture: nothing is left of the render, its bar neither
    assert own.so_far is None


def test_looking_on_never_ends_a_render(scene, clock):
    own = session.of(scene.name)
    grows = growing.Growing(scene, (0, 0, 4, 2))
    grows.begins_with(np.ones((2, 4, 4), np.float32), np.ones((2, 4), np.float32))
    shown, asked = own.so_far.picture, []

    def make(step):
        asked.append(1)
        raise MemoryError

    for clock[0] in (101.0, 110.0):
        grows.show(make)
    assert asked == [1] and own.so_far.picture is shown  # it is not tried again


def test_an_error_is_kept_without_what_its_frame_had(scene):
    try:
        try:
            raise KeyError
        except KeyError as inner:
            raise ValueError("no") from inner
    except ValueError as error:
        session.of(scene.name).fail(error)
    kept = session.of(scene.name).error
    assert str(kept) == "no" and kept.__traceback__ is kept.__context__ is kept.__cause__ is None


def test_a_picture_is_shown_in_its_slot_and_size_alone(scene, clock, monkeypatch):
    monkeypatch.setattr(growing, "_into", [0])
    image = SimpleNamespace(render_slots=SimpleNamespace(active_index=0))
    monkeypatch.setattr(insets, "bpy", SimpleNamespace(data=SimpleNamespace(images={"Render Result": image})))
    growing.Growing(scene, (0, 0, 4, 2))
    context = SimpleNamespace(scene=scene)
    assert insets.growing_in(context) is session.of(scene.name).so_far
    image.render_slots.active_index = 1
    assert insets.growing_in(context) is None
    image.render_slots.active_index = 0
    scene.render.use_border = True
    assert insets.growing_in(context) is None


def test_large_pictures_are_shown_with_fewer_pixels(scene, clock):
    grows = growing.Growing(scene, (0, 0, 3000, 30))
    grows.begins_with(np.ones((30, 3000, 4), np.float32), np.ones((30, 3000), np.float32))
    assert max(session.of(scene.name).so_far.picture.shape) <= growing.LONGEST_SIDE
