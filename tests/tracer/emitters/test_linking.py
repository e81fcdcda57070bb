# SPDX-License-Identifier: GPL-3.0-or-later
"""Light linking: which objects a light lights, and which cast shadows in its light."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import AreaLight, PointLight, Settings, Sphere, World
from hybrid_addon.tracer import trace

LAMP = PointLight("lamp", (0, -3, 4), (30, 30, 30))
SETTINGS = Settings(samples=1, camera_sees="ALL", threads=1, max_depth=2)
FLOOR, LEFT, RIGHT, BALL = range(4)


def things(build, *lights, **other):
    """A mirror floor with two boxes on it and a glass ball; numbers as above. A hidden ball comes before the other."""
    floor = build.quad([(-6, -6, 0), (6, -6, 0), (6, 6, 0), (-6, 6, 0)])
    left, right = (build.box((x, -0.5, 0), (x + 1, 0.5, 1), name) for x, name in ((-2, "left"), (1, "right")))
    scene = build.scene(
        (floor, build.mirror(0.4)), (left, build.matte()), (right, build.matte((0.3, 0.6, 0.8))),
        camera=build.camera((0, -6, 6), size=(48, 48)), lights=lights, **other,
    )  # fmt: skip
    glass = len(scene.surfaces)
    ball = Sphere("ball", (0, 0, 0.6), 0.5, glass, True)
    return replace(scene, spheres=(ball,), surfaces=(*scene.surfaces, build.glass()))


def shows(build, number):
    """(h, w) bool, the pixels in which camera rays meet that object alone."""
    scene = things(build)
    cache = tuple(s if i != number else build.emitter(1, 1, 1) for i, s in enumerate(scene.surfaces))
    plain = replace(SETTINGS, max_depth=0)
    dark = trace(replace(scene, world=World()), plain).radiance
    return (trace(replace(scene, surfaces=cache, world=World()), plain).radiance != dark).any(axis=2)


def test_a_light_lights_what_it_is_linked_to_and_nothing_else(build):
    plain = replace(SETTINGS, max_depth=0)
    every, none = (trace(things(build, *lights), plain).radiance for lights in ((LAMP,), ()))
    linked = trace(things(build, replace(LAMP, receivers=frozenset({LEFT}))), plain).radiance
    left = shows(build, LEFT)
    assert left.sum() > 20
    np.testing.assert_array_equal(linked[left], every[left])
    np.testing.assert_array_equal(linked[~left], none[~left])
    assert (every[~left] != none[~left]).any()


def test_mirrors_and_glass_show_what_is_linked(build):
    """Lights add up: one for the left box, one for all else, together light as one for all."""
    parts = [replace(LAMP, receivers=frozenset(numbers)) for numbers in ({LEFT}, {FLOOR, RIGHT, BALL})]
    whole = trace(things(build, LAMP), SETTINGS).radiance
    halves = [trace(things(build, part), SETTINGS).radiance for part in parts]
    np.testing.assert_allclose(halves[0] + halves[1], whole, rtol=1e-5, atol=1e-7)
    assert (halves[0][~shows(build, LEFT)] > 0).any()  # in the mirror


def test_what_does_not_block_a_light_casts_no_shadow(build):
    numbers = frozenset({FLOOR, LEFT, BALL})
    unlinked = things(build, LAMP)
    free = trace(things(build, replace(LAMP, blockers=numbers)), SETTINGS).radiance
    hidden = list(unlinked.instances)
    hidden[RIGHT] = replace(hidden[RIGHT], visibility=replace(hidden[RIGHT].visibility, shadow=False))
    np.testing.assert_array_equal(free, trace(replace(unlinked, instances=tuple(hidden)), SETTINGS).radiance)
    assert (free != trace(unlinked, SETTINGS).radiance).any()


def test_smoke_that_does_not_block_a_light_does_not_dim_it(build):
    """Nor the light of points inside of it."""
    smoke = build.glass(1.0, absorption=(0.5, 1.0, 2.0))
    floor = build.quad([(-6, -6, 0), (6, -6, 0), (6, 6, 0), (-6, 6, 0)])

    def scene(light, **visibility):
        other = build.box((4, 4, 1), (5, 5, 2))  # light goes through it: what dims light is looked for
        made = build.scene(
            (floor, build.matte()), (build.box((-2, -2, -1), (2, 2, 2)), smoke), (other, build.glass()), lights=(light,)
        )
        floor_, around, glass = made.instances
        hidden = replace(around, visibility=replace(around.visibility, **visibility))
        return replace(made, instances=(floor_, hidden, glass))

    linked = trace(scene(replace(LAMP, blockers=frozenset({0, 2}))), SETTINGS).radiance
    np.testing.assert_array_equal(linked, trace(scene(LAMP, shadow=False), SETTINGS).radiance)
    assert (linked > 1.5 * trace(scene(LAMP), SETTINGS).radiance).mean() > 0.1


def test_other_lights_keep_their_own_blockers(build):
    other = replace(LAMP, name="other", position=(3, 2, 4))
    linked = replace(LAMP, blockers=frozenset({BALL}), receivers=frozenset({FLOOR}))
    both = trace(things(build, linked, other), SETTINGS).radiance.astype(float)
    alone = [trace(things(build, light), SETTINGS).radiance.astype(float) for light in (linked, other)]
    np.testing.assert_allclose(both, sum(alone), rtol=1e-5, atol=1e-7)


def test_links_to_everything_change_no_bit(build):
    every = frozenset(range(4))
    linked = trace(things(build, replace(LAMP, receivers=every, blockers=every)), SETTINGS).radiance
    np.testing.assert_array_equal(linked, trace(things(build, LAMP), SETTINGS).radiance)


def test_a_light_that_is_linked_to_nothing_is_not_asked(build):
    film = trace(
        things(build, replace(LAMP, receivers=frozenset({LEFT, RIGHT}))), replace(SETTINGS, camera_sees="RAY_TRACED")
    )
    nobody = trace(things(build, replace(LAMP, receivers=frozenset())), SETTINGS)
    assert film.rays["shadow"] > 0
    assert nobody.rays["shadow"] == 0


def test_a_link_to_what_is_not_there_is_refused(build):
    with pytest.raises(ValueError, match="light 'lamp': it is linked to object 4, but there are 4"):
        trace(things(build, replace(LAMP, receivers=frozenset({4}))), SETTINGS)


@pytest.mark.parametrize("smooth", [False, True])
def test_a_light_half_below_the_floor_is_the_same_whatever_else_is_in_sight(build, smooth):
    """Of a floor that casts no shadow: its pixels show what they would without the ball, which is curved or not."""
    lamp = AreaLight("lamp", (0, 3, -0.2), (0, -1, 0), (2, 0, 0), (0, 0, 1), (9, 9, 9))
    floor = build.quad([(-6, -6, 0), (6, -6, 0), (6, 6, 0), (-6, 6, 0)])
    parts = (floor, build.matte()), (build.icosphere(1, 0.5, smooth=smooth), build.matte())
    camera = build.camera((0, -6, 6), size=(24, 24))
    both = build.scene(*parts, lights=(replace(lamp, blockers=frozenset()),), camera=camera)
    alone = replace(both, instances=both.instances[:1], lights=(lamp,))
    film = trace(both, SETTINGS)
    np.testing.assert_array_equal(trace(both, replace(SETTINGS, chunk=1)).radiance, film.radiance)
    unshaded = trace(replace(alone, lights=(replace(lamp, cast_shadow=False),)), SETTINGS).radiance
    same = np.isclose(film.radiance, unshaded, rtol=1e-5).all(axis=2)
    assert unshaded[0].min() > 0 and same[0].all() and same.mean() > 0.5
