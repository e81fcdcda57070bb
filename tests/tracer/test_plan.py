"""What is left out, that it is left out, and that leaving it out changes nothing."""

from dataclasses import fields, replace

import numpy as np
import pytest

from hybrid_addon.scene import PointLight, Settings, SunLight, Surface, World
from hybrid_addon.tracer import compiled, trace
from hybrid_addon.tracer.plan import describe

ALL = Settings(samples=2, see="ALL", threads=1)
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
    film = trace(s, replace(ALL, see="FLAGGED"))
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


@pytest.mark.parametrize("number", range(4))
def test_leaving_work_out_changes_no_bit(build, monkeypatch, number):
    s = list(scenes(build))[number]
    planned = trace(s, ALL)
    original = compiled.prepare

    def unplanned(scene, settings):
        prepared = original(scene, settings)
        all_on = {f.name: True for f in fields(prepared.plan) if f.name != "skipped"}
        return replace(prepared, plan=replace(prepared.plan, **all_on))

    monkeypatch.setattr(compiled, "prepare", unplanned)
    everything = trace(s, ALL)
    np.testing.assert_array_equal(everything.radiance, planned.radiance)
    np.testing.assert_array_equal(everything.residual, planned.residual)


def test_describe_says_what_a_trace_would_skip_without_tracing(build):
    s = build.scene((build.box(), build.mirror()), lights=(LAMP,))
    said = describe(s, ALL)
    assert all(set(entry) == {"what", "why", "count"} for entry in said)
    assert {e["what"] for e in said} <= reasons(trace(s, ALL))
