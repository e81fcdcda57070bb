# SPDX-License-Identifier: GPL-3.0-or-later
"""Rounding, degenerate geometry and rays that must never reach Embree."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import PointLight, Settings, Surface, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.core.rays import camera_rays, traceable
from hybrid_addon.tracer.core.stats import Stats
from hybrid_addon.tracer.geometry.aggregate import PrimitiveSet
from hybrid_addon.tracer.geometry.embree import TriangleScene
from hybrid_addon.tracer.geometry.flatten import flatten
from hybrid_addon.tracer.materials.surfaces import compile_surfaces
from hybrid_addon.tracer.shading.interaction import interact

ALL = Settings(samples=1, camera_sees="ALL", threads=1)


def random_rotation(rng):
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


def hits_on(build, mesh, scale, offset, n=20000, seed=0):
    """Hits of rays from outside on a rotated, scaled and moved mesh, and its primitives."""
    rng = np.random.default_rng(seed)
    m = np.eye(4)
    m[:3, :3] = random_rotation(rng) * scale
    m[:3, 3] = offset
    second = m.copy()  # keeps the scene's centre away from the mesh
    second[:3, 3] *= -1
    s = build.scene(surfaces=(build.matte(),))
    s = replace(
        s,
        meshes=(mesh,),
        instances=(build.instance(0, matrix=m), build.instance(0, matrix=second))[: 2 if any(offset) else 1],
    )
    g = flatten(s, [{}])
    center = m[:3, 3] - g.center
    o = rng.normal(size=(3, n))
    o = center[:, None] + o / np.sqrt((o * o).sum(0)) * 3 * scale
    d = center[:, None] + rng.uniform(-0.8, 0.8, (3, n)) * scale - o
    d /= np.sqrt((d * d).sum(0))
    rays = camera_rays(o.astype(np.float32), d.astype(np.float32), np.full(n, np.inf, np.float32), np.zeros(n, np.intp))
    everything = PrimitiveSet(g, np.ones(len(g.surface), bool))
    hits = everything.nearest(rays.origin, rays.direction, Stats())
    chosen = np.flatnonzero((hits.prim >= 0) & (hits.prim < len(mesh.triangles)))
    return everything, interact(g, compile_surfaces(s.surfaces), hits.take(chosen), rays.take(chosen))


def grazing_directions(normal, rng):
    """Directions (3, n) over the whole upper hemisphere, a third of them nearly tangent."""
    n = normal.shape[1]
    t = np.cross(normal, rng.normal(size=(3, n)), axis=0)
    t /= np.sqrt((t * t).sum(0))
    cos = np.where(rng.random(n) < 1 / 3, 10 ** rng.uniform(-4, -1, n), rng.random(n))
    return (cos * normal + np.sqrt(1 - cos * cos) * t).astype(np.float32)


CASES = [(1, 0), (1e-4, 0), (1e4, 0), (1e7, 0), (1, 1e3), (1e-2, 1)]


@pytest.mark.parametrize(("scale", "offset"), CASES)
def test_rays_that_leave_a_convex_body_do_not_hit_it(build, scale, offset):
    for mesh in (build.icosphere(3), build.box()):
        bodies, at = hits_on(build, mesh, scale, (offset, -offset / 3, offset / 7))
        assert len(at.prim) > 5000
        rng = np.random.default_rng(1)
        outward = grazing_directions(at.n_geometric.astype(float), rng)
        stats = Stats()
        away = bodies.nearest(at.outer, outward, stats)
        # (The second body stands far off; a hit closer than the bodies' distance is a self hit.)
        assert np.count_nonzero(away.t < 2 * scale) == 0
        reach = np.full(len(at.prim), 2 * scale, np.float32)
        assert np.count_nonzero(bodies.occluded(at.outer, outward, reach, stats)) == 0


@pytest.mark.parametrize(("scale", "offset"), CASES)
def test_rays_that_enter_a_closed_body_do_not_leak(build, scale, offset):
    for mesh in (build.icosphere(3), build.box()):
        bodies, at = hits_on(build, mesh, scale, (offset, -offset / 3, offset / 7))
        inward = -grazing_directions(at.n_geometric.astype(float), np.random.default_rng(2))
        inside = bodies.nearest(at.inner(slice(None)), inward, Stats())
        assert np.count_nonzero(~(inside.t < 4 * scale)) == 0


def test_spurious_hits_behind_a_ray_are_traced_again(build):
    # Rays that start a hair above a tilted plane, without any offset: Embree reports many of them as hits at t ~ 0.
    rng = np.random.default_rng(0)
    rotation = np.eye(4)
    rotation[:3, :3] = random_rotation(rng)
    s = build.scene(surfaces=(build.matte(),))
    ground = build.quad([(-10, -10, 0), (10, -10, 0), (10, 10, 0), (-10, 10, 0)])
    s = replace(s, meshes=(ground,), instances=(build.instance(0, matrix=rotation),))
    g = flatten(s, [{}])
    n = 20000
    points = g.vertices.astype(float).T @ rng.dirichlet(np.ones(4), n).T
    normal = g.facets[0, :3][:, None]
    direction = grazing_directions(np.broadcast_to(normal, (3, n)), rng)
    above = (points + 1e-7 * normal).astype(np.float32)
    above = above[:, (normal.T @ above.astype(float))[0] > g.facets[0, 3]]
    direction = direction[:, : above.shape[1]]
    raw = TriangleScene(g.vertices, g.triangles).intersect(above, direction)
    stats = Stats()
    hits = PrimitiveSet(g, np.ones(2, bool)).nearest(above, direction, stats)
    assert np.count_nonzero(raw >= 0) > 100  # what would have been acne
    assert np.count_nonzero(hits.prim >= 0) == 0
    assert stats.counts["self_hits"] == np.count_nonzero(raw >= 0)


def test_grazing_hits_outside_of_their_triangle_are_counted(build, monkeypatch):
    """A counter that must be 0 is seen not to be: an Embree that names the wrong triangle."""
    ground = build.mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0), (50, 0, 0), (51, 0, 0), (50, 1, 0)], [(0, 1, 2), (3, 4, 5)])
    camera = build.camera((-3, 0.2, 2e-4), target=(0.2, 0.2, 0), up=(0, 0, 1), half=1e-6)
    scene, once = build.scene((ground, build.matte()), camera=camera), Settings(samples=1, camera_sees="ALL", threads=1)
    film = trace(scene, once)
    assert (film.coverage > 0).all() and film.invariants["barycentrics_out_of_range"] == 0
    intersect = TriangleScene.intersect

    def wrong(self, origin, direction):
        found = intersect(self, origin, direction)
        return np.where(found >= 0, 1 - found, found).astype(found.dtype)

    monkeypatch.setattr(TriangleScene, "intersect", wrong)
    assert trace(scene, once).invariants["barycentrics_out_of_range"] == film.rays["camera"]


def test_a_ray_that_starts_on_another_surface_does_not_pass_through_it(build):
    """As in a corner, where a point of one wall is rounded onto the plane of the next: that is met at distance 0."""
    s = build.scene((build.box((-1, -1, -1), (3, 1, 1)), build.matte()))
    g = flatten(s, [{}])
    rng = np.random.default_rng(3)
    low = g.vertices.min(axis=0)
    n = 1000
    origin = np.stack([rng.uniform(-0.9, 0.9, n), rng.uniform(-0.9, 0.9, n), np.full(n, low[2])]).astype(np.float32)
    out = -grazing_directions(np.tile(np.float64([[0], [0], [1]]), n), rng)
    stats = Stats()
    hits = PrimitiveSet(g, np.ones(len(g.surface), bool)).nearest(origin, out, stats)
    assert (hits.t == 0).all() and (hits.prim >= 0).all()
    assert stats.counts["self_hits"] == 0


def test_bad_rays_are_told_from_good_ones():
    o = np.float32([[0, np.nan, 0, 0, 0, np.inf, 1e30], [0] * 7, [0] * 7])
    d = np.float32([[1, 1, np.nan, 0, np.inf, 1, 0], [0] * 7, [0, 0, 0, 0, 0, 0, 1]])
    np.testing.assert_array_equal(traceable(o, d), [True, False, False, False, False, False, True])


def test_embree_leaves_our_arrays_alone(build):
    ball = build.icosphere(1)
    scene = TriangleScene(ball.vertices, ball.triangles)
    o, d = np.float32([[0, 0], [0, 0], [3, 3]]), np.float32([[0, 1], [0, 0], [-1, 0]])
    t_max = np.float32([5, 5])
    np.testing.assert_array_equal(scene.occluded(o, d, t_max), [True, False])
    np.testing.assert_array_equal(t_max, 5)
    np.testing.assert_array_equal(scene.occluded(o, d, np.float32([1, 1])), [False, False])
    found = scene.intersect(o, d)
    assert found[0] >= 0 and found[1] == -1
    assert scene.intersect(o[:, :0], d[:, :0]).shape == (0,)


# ------------------------------------------------------------------------------------------------ bad geometry


def lit(build, *parts, **other):
    return build.scene(
        *parts, lights=(PointLight("p", (1, -2, 4), (20, 20, 20)),), world=World((0.1, 0.1, 0.1)), **other
    )


def dropped(film):
    return sum(e["count"] for e in film.skipped if e["what"] == "triangles" and "degenerate" in e["why"])


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e30])
def test_triangles_with_bad_vertices_are_left_out_and_counted(build, bad):
    ball = build.icosphere(3)
    holed = replace(ball, vertices=ball.vertices.copy())
    holed.vertices[7, 1] = bad
    fan = (ball.triangles == 7).any(1)
    without = replace(ball, triangles=ball.triangles[~fan], corners=ball.corners[~fan])
    film = trace(lit(build, (holed, build.matte())), ALL)
    assert dropped(film) == fan.sum() > 0
    assert not any(film.invariants.values())
    np.testing.assert_array_equal(film.radiance, trace(lit(build, (without, build.matte())), ALL).radiance)


def test_degenerate_triangles_are_left_out_and_counted(build):
    ball = build.icosphere(2)
    extra = np.array([[0, 0, 5], [3, 3, 3], [1, 2, 1]], np.int32)
    worse = replace(ball, triangles=np.r_[ball.triangles, extra], corners=np.r_[ball.corners, extra])
    film = trace(lit(build, (worse, build.matte())), ALL)
    assert dropped(film) == 3
    np.testing.assert_array_equal(film.radiance, trace(lit(build, (ball, build.matte())), ALL).radiance)


@pytest.mark.parametrize("axes", [(1, 1, 0), (0, 1, 1), (0, 0, 0), (1, 1e-3, 1e3), (-1, -1, -1)])
def test_odd_matrices_give_finite_pictures(build, axes):
    s = lit(build, (build.icosphere(2, 1, smooth=True), build.matte(), {"matrix": np.diag([*map(float, axes), 1])}))
    film = trace(s, ALL)
    assert np.isfinite(film.radiance).all() and not any(film.invariants.values())
    if axes == (1, 1, 0):  # a flat sheet, still there
        assert (film.radiance[8, 8] > 0).all() and (film.radiance[8, 8] != film.radiance[0, 0]).any()


def test_bad_normals_and_uvs_fall_back(build):
    ball = build.icosphere(2, 1, smooth=True)
    bad = replace(ball, normals=np.full_like(ball.normals, np.nan))
    a = trace(lit(build, (bad, build.matte())), ALL).radiance
    b = trace(lit(build, (build.icosphere(2), build.matte())), ALL).radiance
    np.testing.assert_array_equal(a, b)
    zero = replace(ball, normals=np.zeros_like(ball.normals))
    np.testing.assert_array_equal(trace(lit(build, (zero, build.matte())), ALL).radiance, b)


def test_normals_that_point_inward_are_not_believed(build):
    ball = build.icosphere(2, 1, smooth=True)
    inverted = replace(ball, normals=-ball.normals)
    a = trace(lit(build, (inverted, build.matte())), ALL).radiance
    np.testing.assert_array_equal(a, trace(lit(build, (build.icosphere(2), build.matte())), ALL).radiance)


def test_smooth_and_flat_differ_as_they_should(build):
    flat = trace(lit(build, (build.icosphere(2), build.matte())), ALL).radiance
    smooth = trace(lit(build, (build.icosphere(2, 1, smooth=True), build.matte())), ALL).radiance
    fine = trace(lit(build, (build.icosphere(5), build.matte())), ALL).radiance
    middle = (slice(5, 11), slice(5, 11))
    assert np.abs(smooth - fine)[middle].mean() < 0.4 * np.abs(flat - fine)[middle].mean()


@pytest.mark.parametrize("smooth", [False, True])
def test_a_coarse_closed_mirror_never_sees_its_own_inside(build, smooth):
    # White inside, black world outside: any leak through the surface would shine.
    shell = build.icosphere(1, 1, smooth)
    s = build.scene(
        (shell, build.mirror()),
        (build.icosphere(2, 0.9), build.emitter(100, 100, 100)),
        camera=build.camera((0, 0, 4), size=(64, 64), half=0.35),
    )
    film = trace(s, replace(ALL, max_depth=20, samples=4))
    np.testing.assert_array_equal(film.radiance, 0)


def test_no_light_leaks_through_a_coarse_smooth_body(build):
    # A light inside a closed smooth ball reaches nothing outside, not even the ball's own outer side.
    s = build.scene((build.icosphere(1, 1, True), Surface()), lights=(PointLight("p", (0, 0, 0), (100, 100, 100)),))
    np.testing.assert_array_equal(trace(s, replace(ALL, samples=4)).radiance, 0)
