# SPDX-License-Identifier: GPL-3.0-or-later
"""Solids that cross at small angles, nearer to one another than a ray's offset: no medium is lost."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from hybrid_addon.scene import Settings, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.geometry.flatten import flatten
from hybrid_addon.tracer.media import near, solids

ALL = Settings(samples=2, camera_sees="ALL", threads=1, max_depth=16, cutoff=1 / 255)
TILTS = [0.0, 1e-7, 1e-6, 3e-6, 1e-5, 3e-5, 1e-4, 1e-3, 1e-2]


def turned(build):
    q, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    m = np.eye(4)
    m[:3, :3] = q * np.sign(np.linalg.det(q))
    return m


def drink(build, tilt, matrix=None, far=0.0, white=False, joined=False):
    """Water in glass, or both in one mesh of glass: their front faces cross along a line."""
    matrix = np.eye(4) if matrix is None else matrix
    glass, water = build.box(), build.box((-0.8, -1, -0.8), (0.8, 1, 0.8))
    corners = water.vertices.astype(float)
    front = corners[:, 1] < 0
    corners[front, 1] = -1 - tilt * corners[front, 0] / 0.8
    water = replace(water, vertices=corners.astype(np.float32))
    shift = np.float32((far, 0, -far))
    parts = [(glass, build.glass(1.5)), (water, build.glass(1.33))]
    if joined:
        mesh = build.mesh(
            np.concatenate([glass.vertices, water.vertices]),
            [*glass.triangles, *(water.triangles + len(glass.vertices))],
        )
        parts = [(mesh, build.glass(1.5))]
    parts = [(replace(m, vertices=m.vertices + shift), s, {"matrix": matrix}) for m, s in parts]
    floor = build.quad([(-6, -6, -1.5), (6, -6, -1.5), (6, 6, -1.5), (-6, 6, -1.5)])
    glow = build.emitter(1, 1, 1) if white else build.emitter(0.7, 0.2, 0.1)
    around = World((1, 1, 1)) if white else World((0.4, 0.4, 0.4))
    floor = replace(floor, vertices=floor.vertices + shift)
    eye, target, up = (
        (matrix[:3, :3] @ np.add(p, s)) for p, s in (((0, -6, 3), shift), ((0, 0, 0), shift), ((0, 0, 1), 0))
    )
    cam = build.camera(tuple(eye), tuple(target), tuple(up), (64, 48), 0.36)
    return build.scene(*parts, (floor, glow, {"matrix": matrix}), world=around, camera=cam)


def shot(scene, **settings):
    film = trace(scene, replace(ALL, **settings))
    assert film.invariants == {**film.invariants, "lost_media": 0, "nan_pixels": 0}
    return film


@pytest.mark.once
@pytest.mark.parametrize("tilt", TILTS)
@pytest.mark.parametrize("way", ["straight", "turned", "joined"])
def test_no_medium_is_lost_at_any_tilt(build, tilt, way):
    scene = drink(build, tilt, turned(build) if way == "turned" else None, joined=way == "joined")
    film, touching = (
        shot(scene),
        shot(drink(build, 0.0, turned(build) if way == "turned" else None, joined=way == "joined")),
    )
    # Between touching and clearly crossing the picture hardly changes.
    assert np.abs(film.radiance - touching.radiance).mean() < 1e-3


def test_without_a_look_at_what_is_near_media_are_lost(build, monkeypatch):
    monkeypatch.setattr(solids, "find_near", lambda *_: None)
    assert trace(drink(build, 1e-5), ALL).invariants["lost_media"] > 50


@pytest.mark.parametrize("tilt", [3e-6, 1e-5, 1e-4])
def test_white_furnace_of_solids_that_cross(build, tilt):
    film = shot(drink(build, tilt, turned(build), white=True), max_depth=12, cutoff=1e-4)
    np.testing.assert_allclose(film.radiance + film.residual[..., None], 1, atol=2e-6)


@pytest.mark.parametrize("far", [3.0, 300.0])
def test_no_medium_is_lost_far_from_the_middle(build, far):
    """A far thing that is ray traced, too, moves the centre of coordinates away: there rounding is coarser."""
    for tilt in (1e-6, 1e-5, 1e-3):
        scene = drink(build, tilt, far=far)
        counter = build.box((-2 * far, -1, 0), (-2 * far + 1, 1, 1))
        scene = replace(scene, meshes=(*scene.meshes, counter), instances=(*scene.instances, build.instance(3, 0)))
        shot(scene)


@pytest.mark.parametrize("tilt", [1e-6, 1e-5, 2e-5, 1e-4])
@pytest.mark.parametrize("sunk", [0.0, 2e-5, 4e-5, 6e-5, 8e-5])
def test_light_is_bent_once_from_the_first_medium_to_the_last(build, tilt, sunk):
    """Straight down on two faces that cross, and go through one another: each ray sees one order or the other."""
    pool, lid = build.box((-4, -4, -3), (4, 4, 0)), build.box((-5, -5, -4), (5, 5, 0))
    corners = pool.vertices.astype(float)
    top = corners[:, 2] == 0
    corners[top, 2] = tilt * corners[top, 0] - sunk
    pool = replace(pool, vertices=corners.astype(np.float32))
    cam = replace(build.camera((0, 0, 50), size=(64, 4)), projection="ORTHO", view_plane=(-3.9, 3.9, -0.25, 0.25))
    ground = build.quad([(-60, -60, -9), (60, -60, -9), (60, 60, -9), (-60, 60, -9)])
    parts = [(ground, build.emitter(1, 1, 1)), (lid, build.glass(1.5)), (pool, build.glass(1.33))]
    film = shot(build.scene(*parts, camera=cam), samples=1, max_depth=4, cutoff=0.0)

    def through(*steps):
        return np.prod([1 - ((a - b) / (a + b)) ** 2 for a, b in pairwise(steps)])

    above, below = through(1, 1.33, 1.5, 1), through(1, 1.5, 1.33, 1.5, 1)
    # Deeper reflections between four faces add to what goes straight through three.
    off = np.minimum(np.abs(film.radiance - above), np.abs(film.radiance - below))
    assert off.max() < 1.5e-3


@pytest.mark.parametrize("power", [-9, 12])
def test_near_surfaces_scale_by_powers_of_two_exact(build, power):
    big = np.diag([2.0**power] * 3 + [1])
    one, scene = shot(drink(build, 1e-5)), drink(build, 1e-5, big)
    cam = replace(scene.camera, matrix_world=drink(build, 0).camera.matrix_world.copy())
    cam.matrix_world[:3, 3] *= 2.0**power
    cam = replace(cam, clip_start=cam.clip_start * 2.0**power, clip_end=cam.clip_end * 2.0**power)
    np.testing.assert_array_equal(shot(replace(scene, camera=cam)).radiance, one.radiance)


@pytest.mark.parametrize(("threads", "chunk"), [(1, 64), (2, 1000)])
def test_threads_and_chunks_change_no_bit_exact(build, threads, chunk):
    one, other = shot(drink(build, 1e-5)), shot(drink(build, 1e-5), threads=threads, chunk=chunk)
    np.testing.assert_array_equal(one.radiance, other.radiance)


def test_pairs_are_those_that_all_comparisons_find(build):
    rng = np.random.default_rng(5)
    parts = [(build.icosphere(2, 0.6), {"matrix": build.translation(*rng.uniform(-0.4, 0.4, 3))}) for _ in range(5)]
    parts.append((build.box((-0.9, -0.9, -0.1), (0.9, 0.9, 0.1)), {}))  # with far larger triangles
    scene = build.scene(*[(mesh, build.glass(), other) for mesh, other in parts])
    g = flatten(scene, [{}] * len(scene.surfaces))
    prims, size = np.arange(g.triangle_count), np.bincount(g.object)
    found = near.find_near(g, prims, size)
    got = {(p, q) for p in prims.tolist() for q in found.other[found.start[p] : found.start[p + 1]].tolist()}
    a, b = np.nonzero(g.object[:, None] != g.object)
    corners = g.vertices[g.triangles]
    low, high = corners.min(axis=1) - 2e-6, corners.max(axis=1) + 2e-6
    meet = ((low[a] <= high[b]) & (high[a] >= low[b])).all(axis=1)
    a, b = a[meet], b[meet]
    there = near._come_near(g, a, b)
    wanted = set(zip(a[there].tolist(), b[there].tolist(), strict=True))
    assert wanted and got == wanted
