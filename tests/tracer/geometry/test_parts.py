# SPDX-License-Identifier: GPL-3.0-or-later
"""Closed parts of meshes: open ones beside them, seams that differ by rounding, parts inside out and in each other."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import Settings, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.core.constants import WELD
from hybrid_addon.tracer.geometry.parts import closed_parts
from hybrid_addon.tracer.prepare import tables

ONE = Settings(samples=1, camera_sees="ALL", threads=1, max_depth=12)
WHITE = World((1.0, 1.0, 1.0))


def joined(build, *meshes, slots=None):
    """One mesh of several, each with a surface slot of its own if there are any."""
    first = np.cumsum([0] + [len(m.vertices) for m in meshes[:-1]])
    triangles = np.concatenate([m.triangles + f for m, f in zip(meshes, first, strict=True)])
    mesh = build.mesh(np.concatenate([m.vertices for m in meshes]), triangles)
    if slots is None:
        return mesh
    return replace(mesh, surface_slots=np.repeat(slots, [len(m.triangles) for m in meshes]).astype(np.int32))


def moved(mesh, *by):
    return replace(mesh, vertices=(mesh.vertices + np.float32(by)).astype(np.float32))


def inside_out(mesh):
    return replace(mesh, triangles=mesh.triangles[:, ::-1], corners=mesh.corners[:, ::-1])


def loose(build, mesh, noise=0.0, seed=0, scale=1.0, at=(0, 0, 0)):
    """Every triangle on its own, its corners moved by up to `noise` of the largest coordinate."""
    points = mesh.vertices[mesh.triangles].reshape(-1, 3).astype(float) * scale + at
    size = np.abs(points).max()
    points += noise * size * np.random.default_rng(seed).uniform(-1, 1, points.shape)
    return build.mesh(points, np.arange(len(points)))


def colored(build, density=0.7, ior=1.0001):
    """Glass that hardly bends and absorbs green the least."""
    return replace(build.glass(ior), absorption=tuple(density * np.array((0.8, 0.2, 0.8))))


def looking(build, parts, **settings):
    cam = build.camera((0, 0, 5), (0, 0, 0), (0, 1, 0), size=(9, 9), half=0.05)
    film = trace(build.scene(*parts, world=WHITE, camera=cam), replace(ONE, **settings))
    assert film.invariants["lost_media"] == 0
    return film.radiance[4, 4]


GREEN = np.exp(-2 * 0.7 * np.array((0.8, 0.2, 0.8)))
"""What is left of white behind a ball of radius 1."""


# ------------------------------------------------------------------------------------------------ open parts


def sheet(build, z, size=0.3):
    return build.quad([(-size, -size, z), (size, -size, z), (size, size, z), (-size, size, z)])


def half_ball(build):
    ball = build.icosphere(2, 0.5)
    return replace(ball, triangles=ball.triangles[:100], corners=ball.corners[:100])


def test_open_parts_of_a_mesh_have_no_inside(build):
    ball = build.icosphere(2)
    for other in (sheet(build, 2.0), half_ball(build), replace(build.box(), triangles=build.box().triangles[1:])):
        for mesh in (joined(build, ball, other), joined(build, other, ball)):
            found = closed_parts(mesh).part
            n = len(ball.triangles)
            of_ball = found[:n] if mesh.vertices[0].tolist() == ball.vertices[0].tolist() else found[-n:]
            assert (of_ball == 0).all() and np.count_nonzero(found < 0) == len(found) - n


@pytest.mark.parametrize("other", ["sheet", "half ball", "two sheets", "fin"])
def test_what_is_open_takes_no_absorption_from_what_is_closed(build, other):
    ball = build.icosphere(4)
    if other == "fin":  # hangs on an edge of the ball itself
        a, b = ball.triangles[7, :2]
        fin = build.mesh([*ball.vertices[[a, b]], ball.vertices[a] * 1.5], [(0, 1, 2)])
        mesh = build.mesh(
            np.concatenate([ball.vertices, fin.vertices[2:]]), [*ball.triangles, (a, b, len(ball.vertices))]
        )
    else:
        parts = {"sheet": [sheet(build, -1.5)], "half ball": [moved(half_ball(build), 3, 0, 0)]}
        parts["two sheets"] = [sheet(build, -1.5), moved(sheet(build, 0), 2, 2, 0)]
        mesh = joined(build, ball, *parts[other])
    np.testing.assert_allclose(looking(build, [(mesh, colored(build))]), GREEN, atol=3e-3)


def test_parts_of_different_glass_keep_their_own(build):
    red, green = (replace(colored(build), absorption=a) for a in ((0.1, 2.0, 2.0), (2.0, 0.1, 2.0)))
    near, far = moved(build.icosphere(3), 0, 0, 0), moved(build.icosphere(3), 3, 0, 0)
    for order, wanted in (((near, far), (0.1, 2.0, 2.0)), ((far, near), (2.0, 0.1, 2.0))):
        mesh = joined(build, *order, slots=(0, 1))
        scene = build.scene((mesh, red), surfaces=(red, green), world=WHITE)
        scene = replace(scene, instances=(replace(scene.instances[0], surfaces=(0, 1)),))
        cam = build.camera((0, 0, 5), (0, 0, 0), (0, 1, 0), size=(9, 9), half=0.05)
        got = trace(replace(scene, camera=cam), ONE).radiance[4, 4]
        np.testing.assert_allclose(got, np.exp(-2 * np.array(wanted)), atol=3e-3)


# ------------------------------------------------------------------------------------------------ seams


@pytest.mark.parametrize("noise", [0.0, 6e-8, 1e-7, 4e-7, 1e-6])
@pytest.mark.parametrize(("scale", "at"), [(1.0, (0, 0, 0)), (1e-4, (0, 0, 0)), (700.0, (0, 0, 0)), (1.0, (3, -9, 2))])
def test_seams_that_differ_by_rounding_are_closed(build, noise, scale, at):
    ball = loose(build, build.icosphere(3), noise, scale=scale, at=at)
    assert (closed_parts(ball).part == 0).all()


def test_a_gap_that_is_seen_is_no_seam(build):
    ball = loose(build, build.icosphere(2), 100 * WELD)
    assert (closed_parts(ball).part < 0).all()


@pytest.mark.parametrize("noise", [1e-7, 1e-6])
def test_a_ball_with_rounded_seams_absorbs_and_loses_no_ray(build, noise):
    ball = loose(build, build.icosphere(4), noise)
    np.testing.assert_allclose(looking(build, [(ball, colored(build))]), GREEN, atol=3e-3)
    glass = build.scene((ball, build.glass(1.5)), world=WHITE, camera=build.camera((0, 0, 4), size=(96, 96)))
    film = trace(glass, replace(ONE, cutoff=1e-3))
    assert film.invariants["lost_media"] == 0
    np.testing.assert_allclose(film.radiance + film.residual[..., None], 1, atol=2e-6)


def test_what_welds_does_not_depend_on_the_unit(build):
    ball = loose(build, build.icosphere(2), 1e-6)
    same = replace(ball, vertices=ball.vertices * np.float32(2**11))
    np.testing.assert_array_equal(closed_parts(ball).place, closed_parts(same).place)


# ------------------------------------------------------------------------------------------------ in each other


def glowing(build, *parts, size=(48, 36)):
    floor = build.quad([(-9, -9, -1.5), (9, -9, -1.5), (9, 9, -1.5), (-9, 9, -1.5)])
    cam = build.camera((0, -5, 1.5), (0, 0, 0), (0, 0, 1), size, 0.3)
    return build.scene(*parts, (floor, build.emitter(0.7, 0.2, 0.1)), world=World((0.4, 0.4, 0.4)), camera=cam)


@pytest.mark.once
@pytest.mark.parametrize("count", [2, 4, 8, 20])
def test_many_parts_in_one_another_are_as_many_objects(build, count):
    rng = np.random.default_rng(count)
    balls = [moved(build.icosphere(2, 0.8 - 0.01 * k, smooth=False), *rng.uniform(-0.3, 0.3, 3)) for k in range(count)]
    glass, settings = build.glass(1.45), replace(ONE, cutoff=1 / 255)
    films = [
        trace(glowing(build, *parts, size=(32, 24)), settings)
        for parts in ([(joined(build, *balls), glass)], [(ball, glass) for ball in balls])
    ]
    assert [f.invariants["lost_media"] for f in films] == [0, 0]
    apart = np.abs(films[0].radiance - films[1].radiance).max(axis=2)
    assert (apart > 0.05).mean() < 0.02 and apart.mean() < 2e-3


def test_memory_of_a_ray_grows_with_what_can_be_in_one_place(build):
    def rows(*parts):
        return tables.prepare(build.scene(*parts), ONE).media.rows

    glass = build.glass()
    row = [(moved(build.icosphere(1), 1.5 * k, 0, 0), glass) for k in range(12)]
    assert rows(*row) == 2  # each meets two others, but no three are in one place
    assert rows(*[(build.icosphere(1, 1 + k / 10), glass) for k in range(12)]) == 12
    assert rows((joined(build, *[build.icosphere(1, 1 + k / 10) for k in range(12)]), glass)) == 1


def test_a_bottle_in_one_mesh_with_other_glass_is_hollow(build):
    outer, inner = build.icosphere(3, 1.0), inside_out(build.icosphere(3, 0.9))
    bottle = joined(build, moved(build.icosphere(2, 0.3), 3, 0, 0), outer, inner)
    left = np.exp(-0.2 * 0.7 * np.array((0.8, 0.2, 0.8)))
    np.testing.assert_allclose(looking(build, [(bottle, colored(build))]), left, atol=3e-3)


def everted(build, by):
    """A ball whose upper cap was pushed through the middle and out below: there it is inside out."""
    ball = build.icosphere(4)
    z = np.maximum(ball.vertices[:, 2:], 0)
    return replace(ball, vertices=(ball.vertices * (1 - by * z**2)).astype(np.float32))


@pytest.mark.parametrize("case", ["everted", "mirrored half", "flipped beside", "flipped across"])
def test_what_is_turned_inside_out_is_no_fault(build, case):
    ball = build.icosphere(3, 0.7)
    parts = {
        "everted": everted(build, 2.3),
        "mirrored half": joined(build, ball, inside_out(moved(ball, 1.6, 0, 0))),
        "flipped beside": joined(build, ball, moved(ball, 0.5, 0, 0), inside_out(moved(ball, -1.6, 0, 0))),
        "flipped across": joined(build, ball, inside_out(moved(ball, 0.5, 0.1, 0))),
    }
    film = trace(glowing(build, (parts[case], build.glass(1.45))), replace(ONE, cutoff=1e-3))
    assert film.invariants["lost_media"] == 0
    white = replace(glowing(build, (parts[case], build.glass(1.45))), world=WHITE)
    white = replace(white, surfaces=(white.surfaces[0], build.emitter(1, 1, 1)))
    film = trace(white, replace(ONE, cutoff=1e-3))
    assert (film.radiance <= 1 + 2e-6).all() and (film.radiance + film.residual[..., None] >= 1 - 2e-6).all()
