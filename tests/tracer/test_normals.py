"""Mapped normals: normal maps and bumps in closed form, whatever the scale, the side and the angle of view."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon import expressions as ex
from hybrid_addon.scene import Expression, SunLight, Surface
from hybrid_addon.tracer import trace

SHEAR = np.array([[1, 0.5, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])


@pytest.mark.parametrize(
    ("matrix", "tilt"),
    [
        (np.eye(4), (1, 0)),
        (np.diag([0.01, 0.01, 0.01, 1]), (1, 0)),
        (np.diag([100.0, 100, 100, 1]), (1, 0)),
        (np.diag([7, 0.3, 2, 1]), (1, 0)),
        (np.diag([1.0, 1, 0, 1]), (1, 0)),
        (np.diag([-2.0, 1, 1, 1]), (-1, 0)),
        (SHEAR, (1, -0.5)),
    ],
    ids=["unit", "0.01", "100", "uneven", "flat", "mirrored", "sheared"],
)
def test_a_normal_map_tilts_the_normal_along_the_tangent_whatever_the_scale(build, matrix, tilt):
    """By the angle of its pixels; a tangent is turned as normals are."""
    mapped = ((0.6 + 1) / 2, 0.5, (0.8 + 1) / 2)
    frame = Expression("attribute", (), "tangent:"), Expression("attribute", (), "interpolated_normal")
    quad, light = tangent_quad(build), (SunLight("s", (*tilt, 1), (np.pi,) * 3),)
    surface = Surface(base_color=(1, 1, 1), normal=ex.apply("normal_map", mapped, 1.0, *frame))
    s = build.scene((quad, surface, {"matrix": matrix}), lights=light)
    s = replace(s, camera=build.camera(half=1e-4))
    along = np.hypot(*tilt)
    lit = trace(s, build.one_ray).radiance[8, 8, 0]
    assert lit == pytest.approx((0.6 * along + 0.8) / np.sqrt(1 + along**2), rel=1e-5)


def tangent_quad(build, **other):
    tangent = np.tile(np.array([1, 0, 0, 1], np.float32), (4, 1))
    corners = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    return build.quad(corners, attributes={"tangent:": tangent}, **other)


def test_a_normal_map_is_stronger_between_corners_whose_normals_differ(build):
    """MikkTSpace: the normal that it tilts is as interpolation leaves it, shorter than 1 between the corners."""
    lean = np.sqrt(0.5)
    normals = np.float32([(-lean, 0, lean), (lean, 0, lean), (lean, 0, lean), (-lean, 0, lean)])
    quad = tangent_quad(build, normals=normals)
    mapped = (0.9, 0.5, 0.8)
    frame = Expression("attribute", (), "tangent:"), Expression("attribute", (), "interpolated_normal")
    surface = Surface(base_color=(1, 1, 1), normal=ex.apply("normal_map", mapped, 1.0, *frame))
    s = build.scene((quad, surface), lights=(SunLight("s", (1, 0, 1), (np.pi,) * 3),), camera=build.camera(half=1e-4))
    x, z = 0.8, 0.6 * lean  # in the middle of the quad, where the normal is lean long
    assert trace(s, build.one_ray).radiance[8, 8, 0] == pytest.approx((x + z) / np.hypot(x, z) / np.sqrt(2), rel=1e-3)


@pytest.mark.parametrize("kind", ["map", "bump"])
def test_seen_from_behind_a_mapped_normal_is_turned_around(build, kind):
    """A hill on the outer side is a hollow seen from the inner one: the same slope, lit from the other side."""
    if kind == "map":
        frame = Expression("attribute", (), "tangent:"), Expression("attribute", (), "interpolated_normal")
        normal = ex.apply("normal_map", (0.8, 0.5, 0.9), 1.0, *frame)
    else:
        height = ex.apply("multiply", ex.apply("channel", Expression("attribute", (), "position"), data=0), -0.75)
        normal = ex.apply("bump", Expression("slope", (height,)), 1.0, 1.0, Expression("attribute", (), "normal"))
    surface = Surface(base_color=(1, 1, 1), normal=normal)
    for side in (1, -1):
        light = SunLight("s", (side, 0, side), (np.pi,) * 3)
        cam = build.camera((0, 0, 5 * side), half=1e-4)
        s = build.scene((tangent_quad(build), surface), lights=(light,), camera=cam)
        assert trace(s, build.one_ray).radiance[8, 8, 0] == pytest.approx((0.6 + 0.8) / np.sqrt(2), rel=1e-3)
