# SPDX-License-Identifier: GPL-3.0-or-later
"""Nested media: every arrangement has one answer, from whichever side it is seen."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from hybrid_addon.scene import PointLight, Settings, Sphere, SunLight, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.geometry.flatten import flatten
from hybrid_addon.tracer.geometry.parts import closed_parts
from hybrid_addon.tracer.media import touching
from hybrid_addon.tracer.prepare import tables
from hybrid_addon.tracer.prepare.compiled import CompiledScene

GLASS, WATER = 1.5, 1.33
ONE = Settings(samples=1, camera_sees="ALL", threads=1, max_depth=12)
WHITE = World((1.0, 1.0, 1.0))


def fresnel(a, b):
    return ((a - b) / (a + b)) ** 2


def picture(scene, lost=0, **settings):
    film = trace(scene, replace(ONE, **settings))
    assert film.invariants == {**film.invariants, **dict.fromkeys(film.invariants, 0), "lost_media": lost}
    return film


def slab(build, low, high, size=9.0):
    """A plate between two heights, wide as seen from anywhere."""
    return build.box((-size, -size, low), (size, size, high))


def straight_down(build, *parts, **other):
    """What an orthographic camera sees looking down at glowing ground under the parts, in a black world."""
    cam = replace(build.camera((0, 0, 50), size=(2, 2)), projection="ORTHO", view_plane=(-1, 1, -1, 1))
    ground = build.quad([(-60, -60, -9), (60, -60, -9), (60, 60, -9), (-60, 60, -9)])
    return build.scene((ground, build.emitter(1, 1, 1)), *parts, **{"camera": cam, **other})


def through(*steps):
    """Direct transmittance at normal incidence through interfaces between media of the given indices."""
    return np.prod([1 - fresnel(a, b) for a, b in pairwise(steps)])


# ------------------------------------------------------------------------------------------------ what is a solid


def is_closed(mesh):
    return bool((closed_parts(mesh).part >= 0).all())


def test_closed_meshes_are_told_from_open_ones(build):
    ball, box = build.icosphere(2), build.box()
    assert is_closed(ball) and is_closed(box)
    loose = build.mesh(box.vertices[box.triangles].reshape(-1, 3), np.arange(36))
    assert is_closed(loose)  # by place
    assert not is_closed(build.quad([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]))
    assert not is_closed(replace(ball, triangles=ball.triangles[1:]))
    mixed = ball.triangles.copy()
    mixed[5] = mixed[5, ::-1]
    assert not is_closed(replace(ball, triangles=mixed))
    bad = ball.vertices.copy()
    bad[0] = np.nan
    assert not is_closed(replace(ball, vertices=bad))


def media_of(scene):
    return tables.prepare(scene, ONE).media


def test_smaller_solids_come_first(build):
    s = build.scene((build.icosphere(1, 2), build.glass()), (build.icosphere(1, 1), build.glass(WATER)))
    s = replace(s, spheres=(Sphere("bubble", (0, 0, 0), 0.5, 0),))
    m = media_of(s)
    np.testing.assert_array_equal(m.ior, [GLASS, WATER, GLASS, 1.0])
    assert m.rows == 3


@pytest.mark.parametrize("what", ["opaque", "index matched", "open", "inverted"])
def test_scenes_without_solids_track_nothing(build, what):
    ball = build.icosphere(1)
    part = {
        "opaque": (ball, build.matte()),
        "index matched": (ball, build.glass(1.0)),
        "open": (replace(ball, triangles=ball.triangles[1:], corners=ball.corners[1:]), build.glass()),
        "inverted": (replace(ball, triangles=ball.triangles[:, ::-1]), build.glass()),
    }[what]
    assert media_of(build.scene(part)).rows == 0


@pytest.mark.parametrize("rows", [0, 8])
def test_a_longer_stack_or_none_changes_no_bit_where_nothing_nests(build, monkeypatch, rows):
    sheet = build.quad([(-2, -2, -1.5), (2, -2, -1.5), (2, 2, -1.2), (-2, 2, -1.5)])
    s = build.scene(
        (build.icosphere(2, 0.7, smooth=True), build.glass()),
        (build.box((0.8, -0.5, -0.5), (1.6, 0.5, 0.5)), build.glass(2.4, reflectivity=0.25)),
        (sheet, build.glass(1.2)),
        camera=build.camera((0.2, 0.3, 5), size=(32, 32), half=0.4),
        lights=(SunLight("sun", (1, 1, 2), (2, 2, 2)),),
        world=World((0.2, 0.4, 0.6)),
    )
    settings = {"max_depth": 6}
    normal = picture(s, **settings)
    monkeypatch.setattr(tables, "find_solids", _with_rows(tables.find_solids, rows))
    other = picture(s, **settings)
    np.testing.assert_array_equal(normal.radiance, other.radiance)
    np.testing.assert_array_equal(normal.residual, other.residual)


def _with_rows(original, rows):
    def changed(*arguments):
        geometry, media = original(*arguments)
        return geometry, replace(media, rows=rows)

    return changed


# ------------------------------------------------------------------------------------------------ nesting


def test_glass_in_water_in_glass(build):
    parts = [
        (slab(build, -5, 5, 12), build.glass(GLASS)),
        (slab(build, -3, 3, 11), build.glass(WATER)),
        (slab(build, -1, 1, 10), build.glass(GLASS)),
    ]
    direct = through(1, GLASS, WATER, GLASS, WATER, GLASS, 1)
    film = picture(straight_down(build, *parts), max_depth=6)  # straight through spends all bounces
    np.testing.assert_allclose(film.radiance, direct, rtol=1e-6)
    np.testing.assert_allclose(picture(straight_down(build, *parts[::-1]), max_depth=6).radiance, direct, rtol=1e-6)


def test_an_air_bubble_in_water(build):
    parts = [(slab(build, -5, 5, 12), build.glass(WATER)), (slab(build, -1, 1, 10), build.glass(1.0))]
    film = picture(straight_down(build, *parts), max_depth=4)
    np.testing.assert_allclose(film.radiance, through(1, WATER, 1, WATER, 1), rtol=1e-6)


def test_a_round_bubble_reflects_totally_beyond_the_critical_angle(build):
    # Parallel rays in water reach the bubble under asin(h / r): dark beyond h = r / 1.33, but for reflections.
    # A glowing ball that fills the bubble shows which rays get in.
    cam = replace(build.camera((0, 0, 50), size=(200, 2)), projection="ORTHO", view_plane=(0.0, 1.0, -0.005, 0.005))
    surfaces = (build.glass(WATER), build.glass(1.0), build.emitter(1, 1, 1))
    s = build.scene((slab(build, -5, 5, 20), surfaces[0]), camera=cam, surfaces=surfaces)
    s = replace(s, spheres=(Sphere("bubble", (0, 0, 0), 1.0, 1), Sphere("ball", (0, 0, 0), 0.999, 2)))
    row = picture(s, max_depth=2).radiance[0, :, 0]
    edge = np.flatnonzero(np.diff(row > 0))[0] + 1
    assert edge / 200 == pytest.approx(1 / WATER, abs=1.5 / 200)


@pytest.mark.parametrize("d", [0.0, 1e-3, 1e-4, 1e-6, -1e-3])
def test_liquid_against_glass(build, d):
    # Glass above, water below it: they touch at height 0, overlap by d, or leave a gap.
    parts = [(slab(build, 0, 3, 12), build.glass(GLASS)), (slab(build, -3, d, 10), build.glass(WATER))]
    film = picture(straight_down(build, *parts), max_depth=3 if d >= 0 else 4)
    expected = through(1, GLASS, WATER, 1) if d >= 0 else through(1, GLASS, 1, WATER, 1)
    np.testing.assert_allclose(film.radiance, expected, rtol=1e-5)
    upside_down = [
        (slab(build, -3, 0, 12), build.glass(GLASS)),
        (slab(build, -d, 3, 10), build.glass(WATER)),
    ]
    film = picture(straight_down(build, *upside_down), max_depth=3 if d >= 0 else 4)
    np.testing.assert_allclose(film.radiance, expected, rtol=1e-5)


def test_the_answer_does_not_depend_on_the_overlap(build):
    def film(d):
        cup = (build.box((-2, -2, 0), (2, 2, 3)), build.glass(GLASS))
        drink = (build.box((-1.5, -1.5, -1.5), (1.5, 1.5, d)), build.glass(WATER))
        cam = build.camera((1.5, 2, 6), (0, 0, 0), size=(24, 24), half=0.3)
        return picture(straight_down(build, cup, drink, camera=cam, world=World((0.2, 0.5, 0.3))), max_depth=8)

    small, smaller, none = film(1e-3), film(1e-5), film(0.0)
    assert np.quantile(np.abs(small.radiance - none.radiance), 0.98) < 5e-3
    assert np.quantile(np.abs(smaller.radiance - none.radiance), 0.98) < 1e-4


@pytest.mark.parametrize("size", [5.0, 500.0])
@pytest.mark.parametrize("shape", ["box", "loose box", "sphere"])
def test_a_glass_that_stands_on_a_table_stands_in_it(build, shape, size):
    # Coincident faces of glass and table: rays must meet the table, not slip out between the two.
    q, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    m = np.eye(4)
    m[:3, :3] = q * np.sign(np.linalg.det(q))

    def film(depth):
        table = build.quad([(-size, -size, 0), (size, -size, 0), (size, 1.1 * size, 0), (-size, size, 0)])
        cam = build.camera(m[:3, :3] @ (0.4, -2, 4), m[:3, :3] @ (0, 0, 0.3), m[:3, :3] @ (0, 0, 1), (48, 48), 0.3)
        block = build.box((-0.7, -0.7, -depth), (0.7, 0.7, 1.1))
        if shape == "loose box":
            block = build.mesh(block.vertices[block.triangles].reshape(-1, 3), np.arange(36))
        table = (table, build.emitter(1, 1, 1), {"matrix": m, "ray_traced": False})
        if shape != "sphere":
            return picture(build.scene(table, (block, build.glass(GLASS), {"matrix": m}), camera=cam), max_depth=6)
        ball = Sphere("ball", tuple(m[:3, :3] @ (0, 0, 0.5 - depth)), 0.5, 1)
        return picture(
            replace(build.scene(table, camera=cam, surfaces=(table[1], build.glass(GLASS))), spheres=(ball,)),
            max_depth=6,
        )

    on, sunk = film(0.0), film(1e-3)
    assert (np.abs(on.radiance - sunk.radiance).max(2) > 0.05).mean() < 0.02


def test_equal_media_that_touch_are_one(build):
    halves = [(slab(build, 0, 2), build.glass(GLASS)), (slab(build, -2, 0), build.glass(GLASS))]
    whole = straight_down(build, (slab(build, -2, 2), build.glass(GLASS)))
    np.testing.assert_allclose(
        picture(straight_down(build, *halves)).radiance, picture(whole).radiance, rtol=1e-6, atol=1e-7
    )


@pytest.mark.parametrize("rotated", [False, True])
def test_white_furnace_of_touching_and_nested_solids(build, rotated):
    m = np.eye(4)
    if rotated:
        q, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
        m[:3, :3] = q * np.sign(np.linalg.det(q))
    parts = [
        (build.box((-1, -1, -1), (1, 1, 1)), build.glass(GLASS), {"matrix": m}),
        (build.box((-0.5, -0.5, 0), (0.5, 0.5, 1)), build.glass(WATER), {"matrix": m}),  # its top is flush
        (build.box((1, -1, -1), (2, 1, 1)), build.glass(2.4), {"matrix": m}),  # shares a face
        (build.icosphere(1, 0.3), build.glass(1.0), {"matrix": m}),
    ]
    s = build.scene(*parts, world=WHITE, camera=build.camera((0.7, 2, 6), size=(48, 48), half=0.4))
    film = trace(s, replace(ONE, max_depth=10, cutoff=1e-3))
    np.testing.assert_allclose(film.radiance + film.residual[..., None], 1, atol=2e-6)
    # Where three edges of touching bodies meet, float32 may take surfaces in either order.
    assert film.invariants["lost_media"] <= 2e-5 * film.rays["refracted"]


# ------------------------------------------------------------------------------------------------ the camera inside


@pytest.mark.parametrize("projection", ["PERSP", "ORTHO"])
@pytest.mark.parametrize("deep", [1, 2])
def test_a_camera_inside_one_or_two_solids(build, projection, deep):
    # From within glass (in water) a white world is white: radiance is not scaled by n^2.
    parts = [(build.icosphere(3, 2), build.glass(GLASS)), (build.icosphere(3, 4), build.glass(WATER))][:deep]
    cam = replace(build.camera((0.1, 0, 0.5), (0, 0, -1), size=(16, 16)), projection=projection)
    film = picture(build.scene(*parts, world=WHITE, camera=cam), cutoff=1e-3)
    np.testing.assert_allclose(film.radiance + film.residual[..., None], 1, atol=2e-6)
    assert film.radiance.min() > 0.9


def test_a_camera_inside_glass_sees_the_outside_under_the_right_angle(build):
    # Looking up out of water through its flat surface, the horizon lies at the critical angle (Snell's window).
    down = slab(build, -8, 0, 500)
    cam = build.camera((0, 0, -1), (0, 0, 5), (0, 1, 0), (400, 2), 1.5 / 200)
    s = build.scene((down, build.glass(WATER)), world=WHITE, camera=replace(cam, view_plane=(0, 1.5, 0, 0.0075)))
    film = picture(s, max_depth=1)
    row = film.radiance[0, :, 0]
    edge = (np.flatnonzero(row > 0.3)[-1] + 1) / 400 * 1.5
    assert edge == pytest.approx(np.tan(np.arcsin(1 / WATER)), abs=2e-2)


def test_a_camera_in_the_hollow_of_a_bottle_is_in_air(build):
    wall = build.mesh(
        np.concatenate([build.icosphere(2, 2).vertices, build.icosphere(2, 1).vertices]),
        np.concatenate([build.icosphere(2).triangles, build.icosphere(2).triangles[:, ::-1] + 162]),
    )
    s = build.scene((wall, build.glass(GLASS)), world=WHITE, camera=build.camera((0, 0, 0.5), (0, 0, -1)))
    film = picture(s, max_depth=2)
    assert film.radiance[8, 8, 0] == pytest.approx(through(1, GLASS, 1), abs=2e-3)


# ------------------------------------------------------------------------------------------------ what is no solid


def test_an_open_sheet_bends_once_against_whatever_it_lies_in(build):
    sheet = build.quad([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)])
    film = picture(straight_down(build, (sheet, build.glass(GLASS))))
    np.testing.assert_allclose(film.radiance, 1 - fresnel(1, GLASS), rtol=1e-6)
    wet = picture(
        straight_down(build, (slab(build, -3, 3), build.glass(WATER)), (sheet, build.glass(GLASS))), max_depth=3
    )
    np.testing.assert_allclose(wet.radiance, through(1, WATER, 1) * (1 - fresnel(1, GLASS)), rtol=1e-6)


def test_a_body_turned_inside_out_swaps_its_media(build):
    ball = build.icosphere(3, 1, smooth=True)
    s = straight_down(build, camera=build.camera((0, 0, 6), size=(24, 24), half=0.2), world=World((0.2, 0.3, 0.4)))
    s = replace(s, meshes=(*s.meshes, ball), instances=(*s.instances, build.instance(1, 1)))
    swapped = replace(s, surfaces=(*s.surfaces, build.glass(1 / GLASS)))
    inverted = replace(ball, triangles=ball.triangles[:, ::-1], corners=ball.corners[:, ::-1], normals=-ball.normals)
    inverted = replace(s, meshes=(s.meshes[0], inverted), surfaces=(*s.surfaces, build.glass(GLASS)))
    np.testing.assert_allclose(picture(inverted).radiance, picture(swapped).radiance, atol=1e-5)


def test_a_medium_that_is_lost_is_counted(build, monkeypatch):
    original = tables.find_solids

    def forget_to_enter(*arguments):
        geometry, media = original(*arguments)
        return geometry, replace(media, low=media.low + 100, high=media.high + 100)

    monkeypatch.setattr(tables, "find_solids", forget_to_enter)
    inside = build.scene((build.icosphere(2, 2), build.glass()), camera=build.camera((0, 0, 0.5), (0, 0, -1)))
    assert trace(inside, ONE).invariants["lost_media"] > 0


# ------------------------------------------------------------------------------------------------ thin walls


@pytest.mark.parametrize("h", [1e-2, 1e-4, 1e-5, 3e-6, 1e-6, 1e-7, 1e-8, 0.0])
@pytest.mark.parametrize("rotated", [False, True])
def test_thin_glass_tends_to_the_thin_wall(build, h, rotated):
    m = np.eye(4)
    if rotated:
        c, s = np.cos(0.3), np.sin(0.3)
        m[:3, :3] = [[c, 0, s], [0, 1, 0], [-s, 0, c]]
    sheet = (build.box((-1, -1, 0), (1, 1, h)), build.glass(GLASS), {"matrix": m})
    cam = replace(build.camera((0, 0, 5), size=(24, 24)), projection="ORTHO", view_plane=(-0.5, 0.5, -0.5, 0.5))
    film = picture(build.scene(sheet, world=World((0, 0, 0)), camera=cam), max_depth=12)
    ground = build.quad([(-9, -9, -2), (9, -9, -2), (9, 9, -2), (-9, 9, -2)])
    film = picture(build.scene(sheet, (ground, build.emitter(1, 1, 1)), camera=cam), max_depth=12)
    cos_i = np.cos(0.3) if rotated else 1.0
    g = np.sqrt(GLASS**2 - 1 + cos_i**2)
    rs, rp = (cos_i - g) / (cos_i + g), (GLASS**2 * cos_i - g) / (GLASS**2 * cos_i + g)
    r = (rs * rs + rp * rp) / 2
    np.testing.assert_allclose(film.radiance, (1 - r) / (1 + r), atol=1e-3)
    # No shift: the sheet casts its light straight on, and white furnaces stay white.
    white = picture(build.scene(sheet, world=WHITE, camera=cam), max_depth=12)
    np.testing.assert_allclose(white.radiance + white.residual[..., None], 1, atol=1e-6)


def test_the_shadow_of_a_thin_wall_is_that_of_both_faces(build):
    tinted = replace(build.glass(GLASS), transmission_tint=(1, 0.5, 0))
    floor = build.quad([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)])
    sheet = (build.box((-9, -9, 1), (9, 9, 1 + 1e-7)), tinted)
    cam = build.camera((0, 0, 0.9))  # below the sheet
    s = build.scene(
        (floor, build.matte((1, 1, 1))), sheet, lights=(SunLight("sun", (0, 0, 1), (np.pi,) * 3),), camera=cam
    )
    r = fresnel(1, GLASS)
    np.testing.assert_allclose(picture(s).radiance[8, 8], np.array([1, 0.25, 0]) * (1 - r) / (1 + r), rtol=1e-5)


@pytest.mark.parametrize("block", [1, 7, 10**6])
def test_what_a_solid_touches_does_not_depend_on_what_is_asked_first(build, monkeypatch, block):
    """Glass balls and cubes over, in and beside bumpy ground: the same as when all is compared with all."""
    rng = np.random.default_rng(3)
    x, y = np.meshgrid(np.linspace(-2, 2, 12), np.linspace(-2, 2, 12))
    cells = [12 * i + j for i in range(11) for j in range(11)]
    triangles = [t for k in cells for t in ((k, k + 1, k + 13), (k, k + 13, k + 12))]
    ground = build.mesh(np.stack([x, y, np.round(rng.random(x.shape) * 2) / 4], -1).reshape(-1, 3), triangles)
    parts = [(ground, build.matte())]
    for k in range(8):
        shape = build.box((-0.2, -0.2, 0), (0.2, 0.2, 0.4)) if k % 2 else build.icosphere(1, 0.25)
        place = build.translation(*rng.uniform(-1.8, 1.8, 2), np.round(rng.random() * 2) / 4)
        parts.append((shape, build.glass(1.5), {"matrix": place}))
    scene = build.scene(*parts)
    scene = replace(scene, spheres=(Sphere("ball", (0.3, 0.2, 0.75), 0.25, 1),))
    found = []
    for size in (256, block):
        monkeypatch.setattr(touching, "BLOCK", size)
        found.append(tables.prepare(scene, Settings()).geometry)
    np.testing.assert_array_equal(found[0].vertices, found[1].vertices)
    np.testing.assert_array_equal(found[0].sphere_radius, found[1].sphere_radius)
    untouched = flatten(scene, [{}] * len(scene.surfaces))
    assert (found[0].vertices != untouched.vertices).any()


@pytest.mark.parametrize("gap", [0.0, 1e-7, 1e-6])
def test_no_light_slips_between_a_glass_and_the_wall_that_it_touches(build, gap):
    """Shadow rays step over what is within their offset behind a surface: the wall must lie inside of the glass."""
    wall = build.quad([(-9, -9, -gap), (9, -9, -gap), (9, 9, -gap), (-9, 9, -gap)])
    pane = build.box((-2, -2, 0), (2, 2, 0.1))
    ceiling = build.quad([(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)])
    matte, glass = build.matte(), build.glass(GLASS)
    behind = PointLight("behind", (0.3, 0.2, -2), (100, 100, 100))
    cam = build.camera(eye=(0, 0, 0.5), target=(0, 0, 1))
    film = picture(build.scene((wall, matte), (pane, glass), (ceiling, matte), lights=[behind], camera=cam))
    assert film.rays["shadow_steps"] > film.rays["shadow"] > 0  # they do go through the pane
    np.testing.assert_array_equal(film.radiance, 0)


# ------------------------------------------------------------------------------------------------ around the camera


@pytest.mark.parametrize(("height", "inside"), [(5.0, False), (0.6, True)])
def test_solids_are_asked_for_only_where_the_camera_may_be_in_one(build, height, inside):
    """A forked process cannot build their tree: it is there before, or nobody asks."""
    ball = build.icosphere(2, 0.8, smooth=True), build.glass()
    scene = CompiledScene(build.scene(ball, camera=build.camera((0, 0, height), (0, 0, 0), (0, 1, 0))), Settings())
    scene.build_all()
    assert ("solids" in vars(scene)) == inside
