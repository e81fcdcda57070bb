# SPDX-License-Identifier: GPL-3.0-or-later
"""What is left out, that it is left out, and that leaving it out changes nothing."""

from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest

from hybrid_addon.scene import AreaLight, PointLight, Settings, SpotLight, SunLight, Surface, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.geometry import embree
from hybrid_addon.tracer.prepare.prunings import PRUNINGS
from hybrid_addon.tracer.prepare.tables import describe
from hybrid_addon.tracer.shading import shadows
from tests.tracer.unpruned import EXACT, without
from tools.pages.blocks import fill
from tools.pages.from_code import PLAN, plan_blocks

ALL = Settings(samples=2, camera_sees="ALL", threads=1, rough_samples=1, occlusion_samples=1)
LAMP = PointLight("p", (1, -2, 4), (20, 20, 20))


def reasons(film):
    return {entry["what"] for entry in film.skipped}


def test_an_opaque_matte_scene_spawns_nothing(build):
    film = trace(build.scene((build.box(), build.matte()), lights=(LAMP,)), ALL)
    assert film.rays["reflected"] == film.rays["refracted"] == 0
    assert {"reflected rays", "refracted rays", "highlights", "emission", "ambient light"} <= reasons(film)


def test_a_perfect_mirror_needs_no_shadow_rays(build):
    film = trace(build.scene((build.box(), build.mirror()), lights=(LAMP,)), ALL)
    assert film.rays["shadow"] == 0
    assert "diffuse light" in reasons(film)


def test_lights_without_power_are_not_asked(build):
    film = trace(build.scene((build.box(), build.matte()), lights=(replace(LAMP, intensity=(0, 0, 0)),)), ALL)
    assert film.rays["shadow"] == 0
    assert "lights" in reasons(film)


def test_surfaces_that_no_ray_reaches_need_nothing(build):
    glass = (build.icosphere(2), build.glass(), {"ray_traced": False})
    s = build.scene((build.box(), build.matte()), glass, lights=(LAMP,))
    film = trace(s, replace(ALL, camera_sees="RAY_TRACED"))
    assert {"reflected rays", "refracted rays"} <= reasons(film)


def test_a_shadow_ray_is_traced_only_where_light_would_arrive(build):
    sheet = build.quad([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)])
    behind = SunLight("sun", (0, 0, -1), (1, 1, 1))
    film = trace(build.scene((sheet, build.matte()), lights=(behind,)), ALL)
    assert film.rays["shadow"] == 0
    assert sum(e["count"] for e in film.skipped if e["why"] == "no light would arrive") == film.rays["camera"]


def scenes(build):
    ball, box = build.icosphere(2, 1, smooth=True), build.box((1, -1, -1), (2, 1, 1))
    world = World((0.2, 0.3, 0.4))
    yield build.scene((ball, build.matte()), (box, build.matte()), lights=(LAMP,), world=world)
    yield build.scene((ball, build.mirror()), (box, build.emitter(1, 1, 1)), lights=(LAMP,), world=world)
    yield build.scene((ball, build.glass()), (box, Surface(specular=(0.5, 0.5, 0.5))), lights=(LAMP,))
    yield build.scene((ball, build.glass(1.0)), (box, build.matte()), lights=(replace(LAMP, cast_shadow=False),))
    yield build.scene((build.box(), build.matte()), (box, Surface(opacity=0.0, transmission_tint=(0, 0, 0))), lights=())
    yield build.scene((box, build.matte(reflectivity=0.3)), lights=(*odd_lights(), LAMP), world=world)
    yield build.scene((box, build.mirror(0.5)), (ball, build.glass(1.0), {"matrix": build.translation(-1, 0, 0)}))
    unseen, other = {"ray_traced": False}, build.box((-2, 0, 0), (-1, 1, 1))
    yield build.scene(
        (ball, build.mirror()),
        (box, build.emitter(1, 1, 1), unseen),
        (other, build.matte(), unseen),
        lights=tuple(low()),
    )
    pane = build.quad([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    behind = build.box((-1, -1, -3), (1, 1, -2))
    yield build.scene((pane, build.mirror(0.7)), (other, build.matte(), unseen), (behind, build.matte(), unseen))


def low():
    """Lights in the middle of things, which shine on some of them only."""
    down = np.diag((1.0, -1.0, -1.0))
    yield AreaLight("down", (-1.5, 0, 0.5), (0, 0, -1), (2, 0, 0), (0, 2, 0), (9, 9, 9))
    yield SpotLight("up", (1.5, 0.5, 0.5), (9, 9, 9), world_to_light=down, range=2.0)


def odd_lights():
    """Lights that are black, out of range, behind their own cone, and turned away."""
    yield replace(LAMP, intensity=(0, 0, 0))
    yield replace(LAMP, position=(0, 0, 9), range=5.0)
    yield SpotLight("away", (0, 0, 4), (9, 9, 9), world_to_light=np.diag((1.0, -1.0, -1.0)))
    yield AreaLight("up", (0, 0, 4), (0, 0, 1), (1, 0, 0), (0, 1, 0), (9, 9, 9))


ELSEWHERE = {"empty-mask", "unmasked", "unchanged"}  # have tests of their own: below, and test_cache.py


def same(a, b):
    for name in ("radiance", "coverage", "residual", "shadow"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


@pytest.fixture(scope="module")
def planned(build):
    """Every scene, whole and ray traced, with what is left out."""
    every = [
        (s, replace(ALL, camera_sees=camera_sees, max_depth=3))
        for s in scenes(build)
        for camera_sees in ("ALL", "RAY_TRACED")
    ]
    every += [
        (s, replace(settings, raster_shadows=True)) for s, settings in every if settings.camera_sees == "RAY_TRACED"
    ]
    return [(s, settings, trace(s, settings)) for s, settings in every]


def applies(film, name):
    return next(row["applies"] for row in film.plan if row["name"] == name)


def test_each_exact_pruning_has_a_way_to_do_without_it():
    assert {p.name for p in PRUNINGS if p.kind in ("exact", "exact if")} - ELSEWHERE <= {*EXACT}


@pytest.mark.once
@pytest.mark.parametrize("name", sorted({*EXACT} - {"screen-space"}))  # no scene here has a raster
def test_what_is_left_out_changes_no_bit(planned, name):
    for s, settings, film in planned:
        with without(name):
            same(trace(s, settings), film)


def test_all_that_is_left_out_changes_no_bit(planned):
    for s, settings, film in planned:
        with without(*sorted({*EXACT} - {"screen-space"})):
            same(trace(s, settings), film)


def test_each_exact_pruning_applies_somewhere(planned):
    for pruning in PRUNINGS:
        if pruning.name not in ELSEWHERE and "exact" in pruning.kind:
            assert any(applies(film, pruning.name) for _, _, film in planned), pruning.name


def test_what_is_kept_is_done(planned):
    """Rays that are otherwise left out are traced: the tests above compare something."""
    scene, settings, film = planned[0]
    for names, kind in ((["unlit"], "shadow"), (["reflection", "secondary", "weightless"], "reflected")):
        with without(*names):
            assert trace(scene, settings).rays[kind] > film.rays[kind]


def test_pixels_outside_of_the_mask_change_no_bit(build):
    s = build.scene((build.icosphere(2), build.mirror(0.5)), lights=(LAMP,), world=World((0.2, 0.3, 0.4)))
    settings = replace(ALL, camera_sees="RAY_TRACED")
    everywhere = trace(s, settings)
    mask = everywhere.coverage  # in which the pixel filter has spread what is ray traced, as the rasteriser's does
    film = trace(s, settings, mask)
    assert film.rays["camera"] < everywhere.rays["camera"]
    np.testing.assert_array_equal(film.radiance[mask > 0], everywhere.radiance[mask > 0])


def test_an_empty_mask_needs_no_scene(build, monkeypatch):
    s = build.scene((build.icosphere(2), build.mirror(0.5)), lights=(LAMP,), world=World((0.2, 0.3, 0.4)))
    mask = np.zeros((16, 16), np.float32)
    with without("empty-mask"):
        whole = trace(s, replace(ALL, camera_sees="RAY_TRACED"), mask)
    assert not applies(whole, "empty-mask")
    monkeypatch.setattr(embree.EmbreexScene, "__init__", lambda self, *a: pytest.fail("a tree was built"))
    film = trace(s, replace(ALL, camera_sees="RAY_TRACED"), mask)
    assert applies(film, "empty-mask") and "tracing" in reasons(film)
    assert not any(film.rays.values())
    same(film, whole)


@pytest.mark.parametrize("height", [-1e-3, 0.0, 1e-3])
@pytest.mark.parametrize("kind", ["area", "spot"])
def test_a_light_is_left_out_only_if_all_is_behind_it(build, kind, height):
    """It shines down on a wall from just below or above the wall's foot."""
    wall = build.quad([(-1, -1, 0), (1, -1, 0), (1, 1, 2), (-1, 1, 2)])
    place = (0, -1.5, height)
    area = AreaLight("area", place, (0, 0, -1), (0.1, 0, 0), (0, 0.1, 0), (9, 9, 9))
    light = area if kind == "area" else SpotLight("spot", place, (9, 9, 9), cos_cone=0.0)
    s = build.scene((wall, build.matte()), lights=(light,))
    film = trace(s, ALL)
    with without("far-lights"):
        same(trace(s, ALL), film)
    assert ("lights" in reasons(film)) == (height < 0)


@pytest.mark.parametrize("distance", [4.9, 5.0, 5.001, 5.1])
def test_a_light_is_left_out_only_beyond_its_range(build, distance):
    """The floor is straight below: what the light brings at its very range is 0, so both must agree everywhere."""
    floor = build.quad([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    s = build.scene((floor, build.matte()), lights=(replace(LAMP, position=(0, 0, distance), range=5.0),))
    film = trace(s, ALL)
    with without("far-lights"):
        same(trace(s, ALL), film)
    assert ("lights" in reasons(film)) == (distance > 5)
    assert film.radiance.any() == (distance < 5)


def test_a_plan_does_not_change_once_it_is_made(build):
    plan = describe(build.scene((build.box(), build.matte())), ALL)
    with pytest.raises(FrozenInstanceError):
        plan.shadows = True
    with pytest.raises(TypeError):
        plan.applies["unlit"] = False
    with pytest.raises(TypeError):
        plan.saved["unlit"] = 1
    other = plan.with_unchanged({"triangles prepared": 7}, 7)
    assert other.applies["unchanged"] and not plan.applies.get("unchanged")
    assert len(other.skipped) == len(plan.skipped) + 1


def test_the_manual_shows_the_table():
    page = PLAN.read_text(encoding="utf-8")
    assert page == fill(page, plan_blocks()), "run: make pages"


def test_the_plan_says_how_much_was_left_out(build):
    """Counted by hand: a matte quad that fills the picture, half of it masked, one lamp before it and one behind."""
    sheet = build.quad([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)])
    lamps = PointLight("before", (0, 0, 3), (9, 9, 9)), SunLight("behind", (0, 0, -1), (1, 1, 1))
    post = (build.box((20, 20, 1), (21, 21, 2)), build.glass(), {"ray_traced": False})  # its shadow is elsewhere
    scene = build.scene((sheet, build.matte()), post, lights=lamps, camera=build.camera((0, 0, 5), size=(32, 24)))
    mask = np.zeros((24, 32), np.float32)
    mask[:12] = 1
    how = replace(ALL, samples=1, camera_sees="RAY_TRACED", filter_radius=0.5)
    saved = {row["name"]: row["saved"] for row in trace(scene, how, mask).plan}
    assert saved["unmasked"] == 12 * 32
    assert saved["unlit"] + saved["any-hit"] == 2 * 12 * 32 == 2 * saved["any-hit"]
    assert saved["cutoff"] is None
    film = trace(scene, how, mask)
    counts = {entry["what"]: entry["count"] for entry in film.skipped}
    assert counts["emission"] == counts["reflected rays"] == 1  # no ray reaches the glass
    with without("unlit"):
        assert trace(scene, how, mask).rays["shadow"] == film.rays["shadow"] + saved["unlit"]


def test_each_shadow_ray_is_answered_by_any_hit_or_walked(build, monkeypatch):
    """Those that start inside of half clear things are walked at once."""
    walked, walk = [], shadows._transmittance

    def counted(scene, blockers, origin, wi, *rest):
        walked.append(wi.shape[1])
        return walk(scene, blockers, origin, wi, *rest)

    monkeypatch.setattr(shadows, "_transmittance", counted)
    ball, floor = build.icosphere(2, 1, smooth=True), build.quad([(-9, -9, -1), (9, -9, -1), (9, 9, -1), (-9, 9, -1)])
    scene = build.scene((ball, Surface(opacity=0.5, ior=1.5)), (floor, build.matte()), lights=(LAMP,))
    film = trace(scene, ALL)
    saved = {row["name"]: row["saved"] for row in film.plan}["any-hit"]
    assert 0 < saved < film.rays["shadow"] and saved + sum(walked) == film.rays["shadow"]


def test_describe_says_what_a_trace_would_skip_without_tracing(build):
    s = build.scene((build.box(), build.mirror()), lights=(LAMP,))
    said, film = describe(s, ALL), trace(s, ALL)
    assert all(set(entry) == {"what", "why", "count"} for entry in said.skipped)
    assert {e["what"] for e in said.skipped} <= reasons(film)
    assert [{**row, "saved": None} for row in film.plan] == [{**row, "saved": None} for row in said.table()]
    assert [row["name"] for row in film.plan] == [p.name for p in PRUNINGS]
