# SPDX-License-Identifier: GPL-3.0-or-later
"""When to stop tracing, by a clock that stands still."""

from types import SimpleNamespace

import numpy as np
import pytest

from hybrid_addon.blender import session

pytestmark = pytest.mark.blender


@pytest.fixture
def clock(monkeypatch):
    """A clock that goes when it is told to."""
    now = SimpleNamespace(seconds=1000.0)

    class Stopped:
        def __init__(self):
            self.wall = now.seconds

        def read(self):
            return {"wall": now.seconds - self.wall, "cpu": 0.0}

    monkeypatch.setattr(session, "Clock", Stopped)
    monkeypatch.setattr(session, "time", SimpleNamespace(perf_counter=lambda: now.seconds, time=lambda: now.seconds))
    return now


def frame(pixels):
    nothing = np.zeros((1, pixels), np.float32)
    return session.Frame((0, 0, pixels, 1), None, nothing, nothing, {"time": {}})


def test_without_a_budget_there_is_no_deadline(clock):
    assert session.Session().deadline(0.0, 100, 1) == np.inf


def test_the_budget_pays_for_what_comes_after_tracing(clock):
    """First as guessed; then, by the pixel, what it took in the last frame, its picture's development included."""
    pixels, scene = 1_000_000, session.Session()
    scene.begin_frame()
    clock.seconds += 2.0  # exported and drawn
    assert scene.deadline(10.0, pixels, 1) == pytest.approx(1000 + 10 - session.FIRST_TAIL * pixels)
    clock.seconds += 5.0
    scene.sampled(ago=0.5)
    scene.deliver(frame(pixels), "View Layer")
    clock.seconds += 1.0  # composited
    scene.end_frame()
    assert scene.frame.report["time"]["composite"]["wall"] == 1.0
    scene.begin_frame()
    assert scene.deadline(10.0, pixels, 1) == pytest.approx(1008 + 10 - 1.5)
    assert scene.deadline(10.0, 2 * pixels, 1) == pytest.approx(1008 + 10 - 3.0)
    assert scene.deadline(10.0, 1, 1) == pytest.approx(1008 + 10 - session.SHORTEST_TAIL)


def test_parts_share_the_time_that_is_left(clock):
    scene = session.Session()
    scene.begin_frame()
    whole = scene.deadline(12.0, 1, 1) - clock.seconds
    assert scene.deadline(12.0, 1, 3) == pytest.approx(clock.seconds + whole / 3)
    clock.seconds += 2.0
    scene.deliver(frame(1), "first")
    assert scene.deadline(12.0, 1, 3) == pytest.approx(clock.seconds + (whole - 2) / 2)
