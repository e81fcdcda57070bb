"""When to stop tracing, by a clock that stands still."""

from types import SimpleNamespace

import numpy as np
import pytest

from hybrid_addon.blender.render import results

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

    monkeypatch.setattr(results, "Clock", Stopped)
    monkeypatch.setattr(results, "time", SimpleNamespace(perf_counter=lambda: now.seconds))
    for name in ("frames", "reports", "_starts", "_ends", "_sampled", "_tails"):
        monkeypatch.setattr(results, name, {})
    return now


def frame(pixels):
    nothing = np.zeros((1, pixels), np.float32)
    return results.Frame((0, 0, pixels, 1), None, nothing, nothing, {"time": {}})


def test_without_a_budget_there_is_no_deadline(clock):
    assert results.deadline("scene", 0.0, 100) == np.inf


def test_the_budget_pays_for_what_comes_after_tracing(clock):
    """First as guessed; then, by the pixel, what it took in the last frame, its picture's development included."""
    pixels = 1_000_000
    results.start("scene")
    clock.seconds += 2.0  # translated and drawn
    assert results.deadline("scene", 10.0, pixels) == pytest.approx(1000 + 10 - results.FIRST_TAIL * pixels)
    clock.seconds += 5.0
    results.sampled("scene", ago=0.5)
    results.traced("scene", frame(pixels))
    clock.seconds += 1.0  # composited
    results.finish("scene")
    assert results.frames["scene"].report["time"]["composite"]["wall"] == 1.0
    results.start("scene")
    assert results.deadline("scene", 10.0, pixels) == pytest.approx(1008 + 10 - 1.5)
    assert results.deadline("scene", 10.0, 2 * pixels) == pytest.approx(1008 + 10 - 3.0)
    assert results.deadline("scene", 10.0, 1) == pytest.approx(1008 + 10 - results.SHORTEST_TAIL)
