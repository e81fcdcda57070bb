# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture that is visibly too dark because rays ended early says so; what cannot be seen stays quiet."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.measure.stability import build
from hybrid_addon.report.ended import ended_warnings
from hybrid_addon.scene import Scene, Settings, World
from hybrid_addon.tracer import trace

DEFAULTS = Settings(samples=2, camera_sees="ALL", threads=1, max_depth=32, cutoff=1 / 255)


def panes(count: int, world: float = 0.7, size: float = 1.0) -> Scene:
    """Panes of glass in a gray world, in the middle of the picture."""
    parts = [(build.box((-size, k / 2, -size), (size, k / 2 + 0.04, size)), build.glass(1.5)) for k in range(count)]
    lens = build.camera((0.2, -6, 0.4), (0, 0, 0), (0, 0, 1), (24, 18), 0.3)
    return build.make_scene(*parts, camera=lens, world=World((world, world, world)))


def said(scene: Scene, coverage: float = 1.0, **settings: object) -> list[str]:
    chosen = replace(DEFAULTS, **settings)
    return ended_warnings(trace(scene, chosen).ended, chosen, scene.names, coverage)


@pytest.mark.parametrize(("count", "depth"), [(3, 2), (6, 8), (9, 12), (6, 0)])
def test_glass_that_needs_more_bounces_says_so(count: int, depth: int) -> None:
    (line,) = said(panes(count), max_depth=depth)
    assert "Max Bounces" in line and f"more than {depth} bounces" in line and "object" in line
    assert "% of the picture is darker" in line


@pytest.mark.parametrize("count", [1, 3, 6])
def test_glass_with_bounces_enough_is_quiet(count: int) -> None:
    assert said(panes(count)) == []


def test_where_it_cannot_be_seen_it_is_quiet() -> None:
    assert said(panes(6, world=0.0), max_depth=4) == []  # black behind black glass
    assert said(panes(6, world=1e-3), max_depth=4) == []
    assert said(panes(6, size=0.03), max_depth=4) == []  # a speck
    assert said(panes(6, size=0.03), coverage=1e-3, max_depth=4) == []


def test_a_small_object_that_is_all_that_is_traced_counts() -> None:
    assert said(panes(6, size=0.6), coverage=0.002, max_depth=4)


def test_a_cutoff_that_can_be_seen_is_named() -> None:
    (line,) = said(panes(4), cutoff=0.5)
    assert "lower the Min Light of 0.5" in line and "Bounces" not in line


def test_the_line_names_where_most_ends_and_counts_the_rest() -> None:
    ended = {
        "least": 0.125, "share": 0.2, "lost": 0.5, "around": 1.0, "cutoff": 0.0,
        "objects": {0: 1.0, 3: 9.0, 2: 4.0, 1: 2.0, 9: 99.0},
    }  # fmt: skip
    (line,) = ended_warnings(ended, replace(DEFAULTS, max_depth=3), ["a", "b", "c", "d"], 0.5)
    assert line == (
        "10.0% of the picture is darker than it should be, by 50% of its light: rays in d, c, b and 1 more need more "
        "than 3 bounces: raise Max Bounces"
    )
    (line,) = ended_warnings(ended, DEFAULTS, ["one"] * 4, 0.5)
    assert "rays in one need" in line


def test_what_is_counted_does_not_depend_on_who_counts_exact() -> None:
    one = trace(panes(6), replace(DEFAULTS, max_depth=8)).ended
    other = trace(panes(6), replace(DEFAULTS, max_depth=8, threads=2, chunk=100)).ended
    assert one == other and one["share"] > 0.1
    assert np.isfinite([one["lost"], one["around"]]).all()
