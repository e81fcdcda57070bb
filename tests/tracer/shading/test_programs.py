# SPDX-License-Identifier: GPL-3.0-or-later
"""Surface programs: what functions over hits send back and let pass, and that a bad one costs its own object alone."""

import threading
from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon import programs
from hybrid_addon.scene import (
    Expression,
    PointLight,
    Settings,
    Sphere,
    Surface,
    SurfaceAnswer,
    SurfaceProgram,
    World,
)
from hybrid_addon.tracer.render import trace

MIRROR = Surface("mirror", reflectivity=1.0)
FLOOR, GREY = Surface("floor", base_color=(0.6, 0.4, 0.3)), Surface("grey", base_color=(0.5, 0.5, 0.5))


def mirror(hits):
    return SurfaceAnswer(reflection=1.0, reflected=hits.mirror)


@pytest.fixture
def room(build):
    """A smooth ball and a flat box that wear two surfaces, over a grey floor under a lamp and a bright sky."""

    def make(ball, box=GREY):
        floor = build.quad([(-4, -4, -1), (4, -4, -1), (4, 4, -1), (-4, 4, -1)])
        parts = [(floor, FLOOR), (build.icosphere(2, 0.8, smooth=True), ball), (build.box((1, -1, -1), (2, 0, 0)), box)]
        return build.scene(
            *parts,
            camera=build.camera(eye=(2, -5, 2), up=(0, 0, 1), size=(24, 16), half=0.35),
            lights=(PointLight("lamp", position=(2.0, -3.0, 4.0), intensity=(60.0, 60.0, 60.0)),),
            world=World((0.3, 0.5, 0.9)),
        )

    return make


def picture(scene, **settings):
    return trace(scene, Settings(**{"samples": 4, "threads": 1, "fill": False, **settings}))


def worn(hit, shadow=None, **other):
    return replace(GREY, program=SurfaceProgram("tested", hit, shadow, **other))


@pytest.mark.parametrize("cutoff", [0.0, 1 / 255])
def test_the_mirror_rewritten_as_a_program_has_the_same_bits(room, cutoff):
    own = picture(room(MIRROR, MIRROR), cutoff=cutoff)
    found = picture(room(worn(mirror), worn(mirror)), cutoff=cutoff)
    assert np.array_equal(found.radiance, own.radiance)
    assert found.rays == own.rays and not found.problems


def test_threads_and_processes_have_the_functions(room):
    scene = room(worn(mirror))
    one = picture(scene)
    for other in (picture(scene, threads=2, chunk=64), picture(scene, threads=2, chunk=64, processes=True)):
        assert np.array_equal(one.radiance, other.radiance)


def test_all_of_the_material_is_the_material(room):
    own = picture(room(GREY))
    assert np.array_equal(picture(room(worn(lambda hits: SurfaceAnswer(material=1.0)))).radiance, own.radiance)
    assert not np.array_equal(picture(room(worn(lambda hits: SurfaceAnswer(material=0.5)))).radiance, own.radiance)


def test_a_program_sends_the_radiance_that_it_says(room):
    found = picture(room(worn(lambda hits: SurfaceAnswer(radiance=np.array([[1.0], [2.0], [3.0]])))), samples=1)
    here = np.all(np.isclose(found.radiance, (1, 2, 3)), axis=-1)
    assert here.sum() > 20


def test_an_exception_costs_that_object_alone_and_is_one_line(room):
    def broken(hits):
        raise ZeroDivisionError("first\nsecond")

    found = picture(room(worn(broken), MIRROR))
    assert np.array_equal(found.radiance, picture(room(GREY, MIRROR)).radiance)
    assert len(found.problems) == 1
    assert found.problems[0].startswith("object 'object 1': surface program 'tested': ZeroDivisionError: first (")


@pytest.mark.parametrize("wrong", ["text", np.ones((2, 3)), 7])
def test_what_is_no_answer_is_named(room, wrong):
    answer = wrong if isinstance(wrong, int) else SurfaceAnswer(radiance=wrong)
    found = picture(room(worn(lambda hits: answer)))
    assert np.array_equal(found.radiance, picture(room(GREY)).radiance)
    assert len(found.problems) == 1


def test_nan_is_pink_and_counted(room):
    found = picture(room(worn(lambda hits: SurfaceAnswer(radiance=np.nan, reflection=1.0))), samples=1)
    pink = np.all(found.radiance == (1, 0, 1), axis=-1)
    assert pink.sum() > 20
    assert "not a number" in found.problems[0] and np.isfinite(found.radiance).all()


def test_one_that_hangs_costs_that_object_alone(room):
    never = threading.Event()
    calls = []

    def hangs(hits):
        calls.append(len(hits))
        never.wait()

    found = picture(room(worn(hangs, patience=0.001), MIRROR), chunk=64)
    never.set()
    assert np.array_equal(found.radiance, picture(room(GREY, MIRROR)).radiance)
    assert len(calls) == 1 and "took longer than 0.001 s: not called again" in found.problems[0]


def test_shadows_let_pass_what_the_program_says(room):
    def dark(hits):
        return SurfaceAnswer()

    full, none, half = (
        picture(room(worn(dark, lambda hits, share=share: np.where(hits.entering, share, 1)))).radiance
        for share in (1.0, 0.0, 0.5)
    )
    assert (full - none).max() > 0.1
    assert half == pytest.approx((full + none) / 2, abs=1e-5)
    assert np.array_equal(picture(room(worn(dark))).radiance, none)  # without one: as much as passes the material


def test_a_shadow_program_that_fails_leaves_the_shadow_of_the_material(room):
    def broken(hits):
        raise KeyError("x")

    found = picture(room(worn(lambda hits: SurfaceAnswer(material=1.0), broken)))
    assert np.array_equal(found.radiance, picture(room(GREY)).radiance)
    assert "KeyError: 'x'" in found.problems[0]


def test_x_ray_leaves_what_beer_and_lambert_say(build):
    """Straight through a ball's middle lie two radii."""
    program = replace(programs.SHIPPED["X-Ray"], values={"density": 0.7})
    scene = build.scene(
        camera=build.camera(size=(1, 1), half=1e-6),
        surfaces=(replace(GREY, program=program),),
        spheres=(Sphere("ball", (0.0, 0.0, 0.0), 1.5, 0, ray_traced=True),),
        world=World((1.0, 1.0, 1.0)),
    )
    assert trace(scene, build.one_ray).radiance == pytest.approx(np.exp(-0.7 * 3.0), rel=1e-5)


def test_a_portal_to_itself_is_a_hole_and_to_elsewhere_shows_that(build):
    here = build.quad([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    behind = build.quad([(-9, -9, -2), (9, -9, -2), (9, 9, -2), (-9, 9, -2)])
    there = build.quad([(-9, -9, 48), (9, -9, 48), (9, 9, 48), (-9, 9, 48)])
    red, green = build.emitter(1, 0, 0), build.emitter(0, 1, 0)

    def seen(**values):
        window = replace(GREY, program=replace(programs.SHIPPED["Portal"], values=values))
        parts = [(here, window), (behind, red), (there, green)]
        return trace(build.scene(*parts, camera=build.camera(size=(4, 4), half=0.1)), build.one_ray).radiance

    assert seen(camera=np.eye(4)) == pytest.approx(np.broadcast_to((1, 0, 0), (4, 4, 3)))
    assert seen(camera=build.translation(0, 0, 50)) == pytest.approx(np.broadcast_to((0, 1, 0), (4, 4, 3)))
    assert not seen()[..., 1].any()  # no camera: the material


def test_refraction_for_programs_is_the_tracers_own(build):
    ior = 1.4

    def glass(hits):
        toward, total = hits.refracted(ior)
        return SurfaceAnswer(reflection=total, transmission=~total, transmitted=toward)

    ball = Sphere("ball", (0.0, 0.0, 0.0), 1.0, 0, ray_traced=True)

    def through(surface):
        sky = World(Expression("multiply", (Expression("attribute", (), "generated"), (1.0, 1.0, 1.0))))
        camera = build.camera(size=(8, 8), half=0.15)
        return trace(
            build.scene(camera=camera, surfaces=(surface,), spheres=(ball,), world=sky), build.one_ray
        ).radiance

    own = through(Surface("glass", opacity=0.0, ior=ior, interface_tint=(0.0, 0.0, 0.0)))
    assert through(replace(GREY, program=SurfaceProgram("glass", glass))) == pytest.approx(own, abs=1e-4)
    assert own.std() > 0.01


def test_names_are_found_and_forgotten():
    made = programs.register(" mine ", mirror)
    assert programs.find("mine") is made and "mine" in programs.names()
    programs.forget("mine")
    assert programs.find("mine") is None and set(programs.SHIPPED) == {"Toon Glass", "Portal", "X-Ray"}
    with pytest.raises(ValueError, match="is not a function"):
        programs.register("mine", 3)


@pytest.mark.parametrize("name", sorted(programs.SHIPPED))
def test_what_ships_draws_without_a_problem(room, name):
    found = picture(room(replace(GREY, program=programs.SHIPPED[name])), caustics="SIMPLE")
    assert not found.problems and np.isfinite(found.radiance).all()
