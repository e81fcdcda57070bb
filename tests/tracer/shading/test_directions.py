# SPDX-License-Identifier: GPL-3.0-or-later
"""Where light goes: mirrors and prisms of closed form, to a microradian."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import Settings
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.integrator import whitted

MICRORADIAN = 1e-6


@pytest.fixture
def leaving(monkeypatch):
    """Trace a scene; directions (3, n) and throughputs (n,) of the rays that leave it, camera rays left out."""
    seen = []
    original = whitted.add_escaped

    def watch(scene, rays, escaped, sample_buffer, stats):
        gone = rays.take(escaped)
        gone = gone.take(np.flatnonzero(gone.depth > 0))
        seen.append((gone.direction.astype(float), gone.throughput[0]))
        original(scene, rays, escaped, sample_buffer, stats)

    monkeypatch.setattr(whitted, "add_escaped", watch)

    def run(scene, **settings):
        seen.clear()
        trace(scene, Settings(**{"samples": 1, "camera_sees": "ALL", "threads": 1, **settings}))
        return np.concatenate([d for d, _ in seen], axis=1), np.concatenate([w for _, w in seen])

    return run


def angle(a, b):
    """Angles (n,) between directions (3, n) and (3,), precise for small ones."""
    b = np.asarray(b, float)[:, None] / np.linalg.norm(b)
    a = a / np.sqrt((a * a).sum(0))
    return 2 * np.arcsin(np.clip(np.sqrt(((a - b) ** 2).sum(0)) / 2, 0, 1))


def parallel(build, direction, at=(0, 0, 0), half=0.05, size=(9, 9)):
    """An orthographic camera whose rays go along `direction` towards `at`."""
    direction = np.array(direction, float) / np.linalg.norm(direction)
    cam = build.camera(np.array(at) - 5 * direction, at, (0.12, 0.9, 0.4), size, half)
    return replace(cam, projection="ORTHO", view_plane=(-half, half, -half, half))


def rotation(seed):
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    m = np.eye(4)
    m[:3, :3] = q if np.linalg.det(q) > 0 else -q
    return m


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
@pytest.mark.parametrize("seed", range(4))
def test_corner_cube(build, leaving, seed, scale):
    m = rotation(seed)
    d = m[:3, :3] @ (-1, -0.8, -0.9)
    far = 10.0
    walls = [
        build.quad([(0, 0, 0), (far, 0, 0), (far, far, 0), (0, far, 0)]),
        build.quad([(0, 0, 0), (0, far, 0), (0, far, far), (0, 0, far)]),
        build.quad([(0, 0, 0), (0, 0, far), (far, 0, far), (far, 0, 0)]),
    ]
    cam = parallel(build, d, m[:3, :3] @ (0.6, 0.5, 0.7))
    place = cam.matrix_world.copy()
    place[:3, 3] *= scale
    cam = replace(cam, matrix_world=place, view_plane=tuple(scale * v for v in cam.view_plane), clip_start=1e-3 * scale)
    m[:3, :3] *= scale
    s = build.scene(*[(w, build.mirror(), {"matrix": m}) for w in walls], camera=cam)
    out, _ = leaving(s, max_depth=8)
    assert out.shape[1] == 81
    assert angle(out, -d).max() < MICRORADIAN


@pytest.mark.parametrize("seed", range(4))
def test_periscope(build, leaving, seed):
    m = rotation(seed)
    mirrors = [  # at 45 degrees, face to face
        build.quad([(-2, -1, -1), (-2, 1, -1), (0, 1, 1), (0, -1, 1)]),
        build.quad([(-2, -1, -6), (-2, 1, -6), (0, 1, -4), (0, -1, -4)]),
    ]
    d = m[:3, :3] @ (-1, 0, 0)
    s = build.scene(
        *[(w, build.mirror(), {"matrix": m}) for w in mirrors], camera=parallel(build, d, m[:3, :3] @ (-1, 0, 0))
    )
    out, weight = leaving(s, max_depth=2)
    assert out.shape[1] == 81 and (weight == 1).all()
    assert angle(out, d).max() < MICRORADIAN


@pytest.mark.parametrize("n", [1.3, 1.5, 1.8])
@pytest.mark.parametrize("seed", range(3))
def test_prism_at_minimum_deviation(build, leaving, n, seed):
    # Apex angle A = 60 degrees: sin i = n sin(A / 2), deviation 2 i - A.
    apex = np.radians(60)
    i = np.arcsin(n * np.sin(apex / 2))
    half = (2 * i - apex) / 2
    h = np.sqrt(3) / 2
    tri = [(-0.5, -h / 2), (0.5, -h / 2), (0, h / 2)]
    v = [(x, y, z) for y in (-5, 5) for x, z in tri]
    prism = build.mesh(v, [(0, 1, 2), (5, 4, 3), (0, 3, 4), (0, 4, 1), (1, 4, 5), (1, 5, 2), (2, 5, 3), (2, 3, 0)])
    m = rotation(seed)
    d_in = m[:3, :3] @ (np.cos(half), 0, np.sin(half))
    d_out = m[:3, :3] @ (np.cos(half), 0, -np.sin(half))
    s = build.scene((prism, build.glass(n), {"matrix": m}), camera=parallel(build, d_in, half=0.02))
    out, weight = leaving(s, max_depth=2)
    direct = weight > 0.5
    assert direct.sum() == 81
    assert angle(out[:, direct], d_out).max() < MICRORADIAN


@pytest.mark.parametrize("seed", range(3))
def test_a_plane_parallel_plate_does_not_turn_light(build, leaving, seed):
    m = rotation(seed)
    d = m[:3, :3] @ (0.5, 0.2, -1)
    plate = build.box((-9, -9, -0.3), (9, 9, 0.3))
    s = build.scene((plate, build.glass(1.5), {"matrix": m}), camera=parallel(build, d))
    out, weight = leaving(s, max_depth=2)
    direct = weight > 0.5
    assert direct.sum() == 81
    assert angle(out[:, direct], d).max() < MICRORADIAN
