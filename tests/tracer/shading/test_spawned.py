# SPDX-License-Identifier: GPL-3.0-or-later
"""A million rays that leave surfaces: none meets the surface that it leaves, none leaks through it."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.tracer.core.rays import camera_rays
from hybrid_addon.tracer.core.stats import Stats
from hybrid_addon.tracer.geometry.aggregate import PrimitiveSet
from hybrid_addon.tracer.geometry.flatten import flatten
from hybrid_addon.tracer.materials.surfaces import compile_surfaces
from hybrid_addon.tracer.shading.interaction import interact

RAYS = 1_000_000  # for each setting, shared by two bodies, two ways and 25 rays a hit
HITS = RAYS // 4 // 25

SETTINGS = [(10.0**k, 0.0) for k in range(-4, 8)] + [(1.0, 1.0), (1.0, 1e2), (1.0, 1e4), (1e-1, 1e2), (1e2, 1e4)]


def rotation(rng):
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


def hits_on(build, mesh, scale, offset):
    """Hits from all sides on a rotated body of that size, that far from the centre of the scene."""
    rng = np.random.default_rng(0)
    m = np.eye(4)
    m[:3, :3], m[:3, 3] = rotation(rng) * scale, np.array([1, -1 / 3, 1 / 7]) * offset
    far = m.copy()  # a second one, opposite, keeps the centre where it is
    far[:3, 3] *= -1
    places = [build.instance(0, matrix=m)] + ([build.instance(0, matrix=far)] if offset else [])
    s = replace(build.scene(surfaces=(build.matte(),)), meshes=(mesh,), instances=tuple(places))
    g = flatten(s, [{}])
    center = (m[:3, 3] - g.center)[:, None]
    o = rng.normal(size=(3, 2 * HITS))
    o = center + o / np.sqrt((o * o).sum(0)) * 3 * scale
    d = center + rng.uniform(-0.5, 0.5, o.shape) * scale - o
    d = (d / np.sqrt((d * d).sum(0))).astype(np.float32)
    n = o.shape[1]
    rays = camera_rays(o.astype(np.float32), d, np.full(n, np.inf, np.float32), np.arange(n))
    bodies = PrimitiveSet(g, g.object == 0)
    hits = bodies.nearest(rays.origin, rays.direction, Stats())
    chosen = np.flatnonzero(hits.prim >= 0)[:HITS]
    assert len(chosen) == HITS
    return bodies, interact(g, compile_surfaces(s.surfaces), hits.take(chosen), rays.take(chosen))


def directions(normal, rng):
    """Over the hemisphere around the normals (3, n), every third one nearly tangent."""
    n = normal.shape[1]
    t = np.cross(normal, rng.normal(size=(3, n)), axis=0)
    t /= np.sqrt((t * t).sum(0))
    cos = np.where(np.arange(n) % 3 == 0, 10 ** rng.uniform(-4, -1, n), rng.random(n))
    return (cos * normal + np.sqrt(1 - cos * cos) * t).astype(np.float32)


@pytest.mark.parametrize(("scale", "offset"), SETTINGS, ids=lambda v: f"{v:g}")
def test_no_self_hit_and_no_leak_in_a_million(build, scale, offset):
    rng = np.random.default_rng(1)
    for mesh in (build.icosphere(3), build.box()):
        bodies, at = hits_on(build, mesh, scale, offset)
        normal = at.n_geometric.astype(float)
        inner = at.inner(slice(None))
        self_hits = leaks = 0
        for _ in range(25):
            w, stats = directions(normal, rng), Stats()
            self_hits += np.count_nonzero(bodies.nearest(at.outer, w, stats).prim >= 0)
            leaks += np.count_nonzero(bodies.nearest(inner, -w, stats).prim < 0)
            assert not stats.counts["self_hits"]
        assert (self_hits, leaks) == (0, 0)
