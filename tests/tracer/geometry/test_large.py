# SPDX-License-Identifier: GPL-3.0-or-later
"""Large triangles next to small ray traced objects: split, and nothing else changes."""

import numpy as np
import pytest

from hybrid_addon.scene import Expression, PointLight, Settings, Surface, Texture, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.core.rays import offset_origin, origin_offset
from hybrid_addon.tracer.core.stats import Stats
from hybrid_addon.tracer.geometry import flatten as flatten_module
from hybrid_addon.tracer.geometry.aggregate import PrimitiveSet
from hybrid_addon.tracer.geometry.flatten import flatten

RADIUS, GAP = 1e-3, 2e-5
ALL = Settings(samples=1, camera_sees="ALL", threads=1)


def tilt():
    """A rotation about no axis in particular: an unrotated ground proves nothing."""
    q, r = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))
    m = np.eye(4)
    m[:3, :3] = q * np.sign(np.diag(r))
    m[:3, 0] *= np.sign(np.linalg.det(m[:3, :3]))
    return m


def ground_and_ball(build, width, **other):
    """A tilted ground of that half width, off centre, and a ray traced 2 mm ball 20 um above it."""
    low, high = np.array([-1.0, -0.7]) * width, np.array([0.9, 1.1]) * width
    ground = build.quad([(low[0], low[1], 0), (high[0], low[1], 0), (high[0], high[1], 0), (low[0], high[1], 0)])
    m = tilt()
    place = m.copy()
    place[:3, 3] = m[:3, 2] * (RADIUS + GAP)
    s = build.scene(
        (ground, build.matte(), {"matrix": m, "ray_traced": False}),
        (build.icosphere(3, RADIUS), build.matte(), {"matrix": place}),
        **other,
    )
    return s, m[:3, 2], place[:3, 3]


def near_ground(g, up, ball, n, rng, near=3e-3):
    """Points of the ground (3, n) within `near` of the ball's foot, and offset origins above them."""
    side = np.linalg.svd(up[None])[2][1:]
    point = ball[:, None] - up[:, None] * (RADIUS + GAP) + side.T @ rng.uniform(-near, near, (2, n))
    ground = PrimitiveSet(g, ~g.ray_traced)
    start = (point - g.center[:, None] + up[:, None] * RADIUS).astype(np.float32)
    down = np.broadcast_to(-up[:, None], point.shape).astype(np.float32)
    hits = ground.nearest(start, down, Stats())
    assert (hits.prim >= 0).all()
    p = start + hits.t * down
    return p, offset_origin(p, hits.normal, origin_offset(p.astype(np.float32), g.extent[hits.prim]))


@pytest.mark.parametrize("width", [10.0, 1e3, 1e4])
def test_shadow_rays_of_a_huge_ground_find_a_tiny_ball(build, width):
    rng = np.random.default_rng(0)
    s, up, ball = ground_and_ball(build, width)
    g = flatten(s, [{}, {}])
    assert g.split > 10
    assert seen_from_below(g, up, ball, 100_000) == 100_000
    _, origin = near_ground(g, up, ball, 100_000, rng)
    away = (up[:, None] + rng.normal(size=(3, 100_000)) * 0.1).astype(np.float32)
    only_ground = PrimitiveSet(g, ~g.ray_traced)
    again = only_ground.nearest(origin, away / np.sqrt((away * away).sum(0)), Stats())
    assert np.count_nonzero(again.prim >= 0) == 0


RAYS = 1_000_000  # for each setting: 25 a hit, one half up from above the ground, one up from below it
HITS = RAYS // 2 // 25


@pytest.mark.once
@pytest.mark.parametrize(
    ("scale", "offset"),
    [(1e-4, 0), (1e-2, 0), (1, 0), (1e2, 0), (1e4, 0), (1e7, 0), (1, 1), (1, 1e2), (1, 1e4), (0.1, 1e2), (1e2, 1e4)],
    ids=lambda v: f"{v:g}",
)
def test_no_self_hit_and_no_leak_of_a_ground_in_a_million(build, scale, offset):
    """A tilted ground with a 2 mm ball on it, times scale; a second ball keeps the centre `offset` away."""
    rng = np.random.default_rng(2)
    m, width, radius = tilt(), 10 * scale + 3 * offset, RADIUS * scale
    ground = build.quad([(-width, -0.7 * width, 0), (0.9 * width, -0.7 * width, 0), (0, width, 0), (-width, width, 0)])
    feet = [m[:3, :3] @ np.multiply((0.6, -0.3, 0), way * offset) for way in ((1, -1) if offset else (1,))]
    balls = []
    for foot in feet:
        place = m.copy()
        place[:3, 3] = foot + m[:3, 2] * radius * 1.02
        balls.append((build.icosphere(2, radius), build.matte(), {"matrix": place}))
    s = build.scene((ground, build.matte(), {"matrix": m, "ray_traced": False}), *balls)
    g = flatten(s, [{}] * len(s.surfaces))
    assert g.split > 10
    only_ground = PrimitiveSet(g, ~g.ray_traced)
    away = radius * 10 ** rng.uniform(-1, 3, HITS)  # from the foot of the ball to far away
    angle = rng.uniform(0, 2 * np.pi, HITS)
    point = (feet[0] - g.center)[:, None] + m[:3, :2] @ (away * np.stack([np.cos(angle), np.sin(angle)]))
    down = np.broadcast_to(-m[:3, 2:3], point.shape).astype(np.float32)
    start = (point + m[:3, 2:3] * np.maximum(radius, 1e-3 * offset)).astype(np.float32)
    hits = only_ground.nearest(start, down, Stats())
    p, extent = start + hits.t * down, g.extent[hits.prim]
    gap = origin_offset(p.astype(np.float32), extent)
    outer, inner = offset_origin(p, hits.normal, gap), offset_origin(p, hits.normal, -gap)
    stats, self_hits, leaks = Stats(), 0, 0
    for _ in range(25):
        side = np.cross(hits.normal, rng.normal(size=(3, HITS)), axis=0)
        side /= np.sqrt((side * side).sum(0))
        cos = np.where(np.arange(HITS) % 3 == 0, 10 ** rng.uniform(-4, -1, HITS), rng.random(HITS))
        w = (cos * hits.normal + np.sqrt(1 - cos * cos) * side).astype(np.float32)
        self_hits += np.count_nonzero(only_ground.nearest(outer, w, stats).prim >= 0)
        leaks += np.count_nonzero(only_ground.nearest(inner, w, stats).prim < 0)
    assert (self_hits, leaks, stats.counts["self_hits"]) == (0, 0, 0)


def seen_from_below(g, up, ball, n):
    """How many of n rays straight up from the ground below the ball meet it."""
    _, origin = near_ground(g, up, ball, n, np.random.default_rng(0), 5e-4)
    onward = np.broadcast_to(up[:, None], origin.shape).astype(np.float32)
    hits = PrimitiveSet(g, np.ones(len(g.surface), bool)).nearest(origin, onward, Stats())
    return np.count_nonzero((hits.prim >= 0) & g.ray_traced[hits.prim] & (hits.toward < 0))


def test_without_the_split_they_miss_it(build, monkeypatch):
    monkeypatch.setattr(flatten_module, "split_large_triangles", lambda soup, balls: soup)
    s, up, ball = ground_and_ball(build, 1e4)
    assert seen_from_below(flatten(s, [{}, {}]), up, ball, 1000) < 500


@pytest.mark.parametrize("smooth", [False, True])
def test_splitting_does_not_change_the_picture(build, monkeypatch, smooth):
    rng = np.random.default_rng(1)
    corners = [(-50, -40, 0), (60, -40, 0), (60, 70, 0), (-50, 70, 0)]
    normals = np.float32([(0, 0, 1), (0.1, 0, 1), (0.2, 0.1, 1), (0, 0.1, 1)]) if smooth else None
    uvs = {"": np.float32([(0, 0), (3, 0.1), (3, 2), (-0.2, 2)])}
    floor = build.quad(corners, normals=normals, uv_maps=uvs)
    surface = Surface(
        base_color=Expression("image", (), Texture("t", rng.random((4, 4, 4)).astype(np.float32))),
        reflectivity=0.2,
        opacity=0.9,
    )
    s = build.scene(
        (floor, surface, {"ray_traced": False, "matrix": tilt()}),
        (build.icosphere(1, 0.02), build.matte()),
        camera=build.camera((3, -7, 9), (1, 1, 0), (0, 0, 1), (48, 48), 2.0),
        lights=(PointLight("p", (3, -4, 20), (900, 900, 900)),),
        world=World((0.3, 0.4, 0.5)),
    )
    split = trace(s, ALL)
    assert any(e["why"].startswith("large") and e["count"] > 10 for e in split.skipped)
    monkeypatch.setattr(flatten_module, "split_large_triangles", lambda soup, balls: soup)
    whole = trace(s, ALL)
    np.testing.assert_array_equal(split.coverage, whole.coverage)
    assert np.count_nonzero(np.abs(split.radiance - whole.radiance).max(2) > 2e-5) <= 4  # on edges of the ball


def test_parts_keep_the_order_of_objects_and_cover_the_whole(build):
    s, _, _ = ground_and_ball(build, 100.0)
    g = flatten(s, [{}, {}])
    assert (np.diff(g.object) >= 0).all()
    corners = g.vertices[g.triangles[~g.ray_traced]].astype(float)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    assert area == pytest.approx(190 * 180, rel=1e-6)
    # No cracks: every edge inside the quad is walked once each way, between the very same points.
    a, b = corners[:, [0, 1, 2]].reshape(-1, 3), corners[:, [1, 2, 0]].reshape(-1, 3)
    forth = {(*p, *q) for p, q in zip(a.tolist(), b.tolist(), strict=True)}
    loose = [e for e in forth if (*e[3:], *e[:3]) not in forth]
    assert len(forth) == len(a)
    turned = np.array(loose).reshape(-1, 2, 3) @ tilt()[:3, :3]
    centred = turned + (g.center @ tilt()[:3, :3])
    on_rim = np.isclose(centred[..., :2, None], [-100, -70, 90, 110], atol=1e-3).any(axis=(2, 3)).all(axis=1)
    assert on_rim.all()


def test_ordinary_scenes_are_left_alone(build):
    floor = build.quad([(-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0)])
    g = flatten(build.scene((floor, build.matte()), (build.icosphere(2, 0.5), build.matte())), [{}, {}])
    assert g.split == 0 and len(g.triangles) == 2 + 320
