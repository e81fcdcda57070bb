# SPDX-License-Identifier: GPL-3.0-or-later
"""Fog: closed forms of slabs, furnaces and lamps; bodies that overlap, touch, hold glass or the camera; extremes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import (
    Camera,
    Fog,
    FogBody,
    Instance,
    Medium,
    PointLight,
    Scene,
    Settings,
    Sphere,
    SunLight,
    Surface,
    TriangleMesh,
    World,
)
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.integrator import fog as integrator_fog
from hybrid_addon.tracer.integrator.fog import phase
from hybrid_addon.tracer.media.fog import CompiledFog, sorted_out

WHITE = World((1.0, 1.0, 1.0))
BLACK = World()
HG_STEPS = np.linspace(-1, 1, 200001)


def integral(values, at):
    """By trapezoids."""
    return float(((values[1:] + values[:-1]) / 2 * np.diff(at)).sum())


def cube(center=(0, 0, 0), size=(4, 4, 4), flip=False):
    """Vertices of a unit cube, and the matrix that places it; flip: turned inside out."""
    corners = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)], np.float32)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))], np.int32)
    faces = faces[:, ::-1].copy() if flip else faces
    matrix = np.diag([*size, 1.0]).astype(float)
    matrix[:3, 3] = center
    return TriangleMesh("cube", corners, faces, faces), matrix


def box(medium, *where, **kind):
    mesh, matrix = cube(*where, **kind)
    return FogBody("box", mesh, matrix, medium)


def seen(fog=None, world=BLACK, lights=(), samples=1, sees="ALL", **things):
    """(3,) the middle of a narrow picture from 10 m above, and how much its pixels differ."""
    place = np.eye(4)
    place[2, 3] = 10
    camera = Camera("PERSP", place, (-0.001, 0.001, -0.001, 0.001), (6, 6), (0, 0, 6, 6), clip_start=1e-3)
    scene = Scene(camera, world=world, lights=lights, fog=fog or Fog(), **things)
    film = trace(scene, Settings(samples=samples, camera_sees=sees, threads=1))
    assert not any(film.invariants.values()), film.invariants
    return film.radiance.mean(axis=(0, 1)), film.radiance.std(axis=(0, 1)).max()


def slab(**medium):
    return Fog(bodies=(box(Medium(**medium)),))


def test_a_slab_dims_by_beer_and_lambert():
    found, _ = seen(slab(absorption=(0.2, 0.1, 0.0)), WHITE)
    np.testing.assert_allclose(found, np.exp([-0.8, -0.4, 0]), rtol=1e-5)


def test_a_slab_glows_in_closed_form():
    found, _ = seen(slab(absorption=(0.5, 0, 0), emission=(0.2, 1, 0)))
    np.testing.assert_allclose(found, (0.4 * (1 - np.exp(-2)), 4, 0), rtol=1e-5)


@pytest.mark.parametrize("g", [-0.9, 0.0, 0.9])
def test_a_white_world_stays_white_in_fog_that_absorbs_nothing(g):
    found, _ = seen(slab(scattering=(0.2, 3.0, 1e6), anisotropy=g), WHITE)
    np.testing.assert_allclose(found, 1, rtol=1e-6)


@pytest.mark.parametrize("g", [-0.7, 0.0, 0.4, 0.95])
def test_the_phase_function_sends_on_all_of_the_light(g):
    total = 2 * np.pi * integral(phase(HG_STEPS, np.full(len(HG_STEPS), g)), HG_STEPS)
    assert total == pytest.approx(1, rel=1e-3)


@pytest.mark.parametrize("g", [0.0, 0.6])
def test_a_sun_in_a_slab_has_a_closed_form(g):
    """It shines along the view: fog that scatters forward sends little of it back."""
    sun = SunLight("sun", direction=(0, 0, 1), irradiance=(10, 10, 10), cast_shadow=False)
    sigma = np.array([0.01, 0.5, 30.0])
    found, _ = seen(slab(scattering=tuple(sigma), anisotropy=g), lights=(sun,), samples=256)
    expected = 10 * phase(np.array(-1.0), np.array(g)) * (1 - np.exp(-4 * sigma))
    np.testing.assert_allclose(found, expected, rtol=0.01)


@pytest.mark.parametrize("height", [3.0, 0.2, 0.01])
@pytest.mark.parametrize("sigma", [0.01, 0.5, 20.0])
def test_a_lamp_beside_the_ray_or_all_but_on_it_is_found(height, sigma):
    lamp = PointLight("lamp", (0, height, 0), intensity=(80, 80, 80), cast_shadow=False)
    found, noise = seen(slab(scattering=(sigma,) * 3), lights=(replace(lamp, position=(0, height, 0)),), samples=256)
    y = height * np.tan(np.linspace(-np.arctan(2 / height), np.arctan(2 / height), 100001))
    expected = integral(sigma * 80 / (4 * np.pi) / (height**2 + y**2) * np.exp(-sigma * (y + 2)), y)
    rtol = 0.02 if height > 0.1 or sigma == 20 else 0.5  # the picture is as wide as the lamp is near
    np.testing.assert_allclose(found, expected, rtol=rtol)
    assert noise < 0.2 * expected or height < 0.1


def test_fog_is_in_the_shadow_of_what_stands_in_it():
    sun = SunLight("sun", direction=(0, 1, 0), irradiance=(10, 10, 10))
    wall, matrix = cube((0, 3, 0), (4, 1, 4))
    thing = Instance("wall", 0, matrix, (0,))
    open_sky, _ = seen(slab(scattering=(0.1,) * 3), lights=(sun,), samples=16)
    shade, _ = seen(
        slab(scattering=(0.1,) * 3),
        lights=(sun,),
        samples=16,
        meshes=(wall,),
        instances=(thing,),
        surfaces=(Surface(),),
    )
    assert open_sky.min() > 0.2 and shade.max() == 0


def test_fog_dims_lamps_in_fog_only_where_it_is_asked_to():
    sun = SunLight("sun", direction=(0, 1, 0), irradiance=(10, 10, 10))
    body = box(Medium(scattering=(0.5,) * 3))
    plain = 10 / (4 * np.pi) * (1 - np.exp(-2))
    for shadows, expected in ((False, plain), (True, plain * np.exp(-1))):
        found, _ = seen(Fog(bodies=(body,), shadows=shadows), lights=(sun,), samples=64)
        np.testing.assert_allclose(found, expected, rtol=0.01)


def test_bodies_that_overlap_and_touch_add_up():
    """The faces at z = 2 lie in one plane."""
    medium = Medium(absorption=(0.2, 0.1, 0))
    fog = Fog(Medium(absorption=(0.05,) * 3), (box(medium), box(medium, (0, 0, 1), (2, 2, 2))), reach=20)
    found, _ = seen(fog, WHITE)
    np.testing.assert_allclose(found, np.exp([-1 - 1.2, -1 - 0.6, -1]), rtol=1e-4)


def test_the_worlds_fog_ends_where_it_is_said_to():
    found, _ = seen(Fog(Medium(emission=(0.01, 0.02, 0)), reach=50))
    np.testing.assert_allclose(found, (0.5, 1, 0), rtol=1e-4)


def test_camera_rays_meet_fog_only_as_deep_as_it_is_drawn():
    """From 4 to 11 m: 3 m of the slab, which lies from 8 to 12 m."""
    fog = Fog(bodies=(box(Medium(emission=(0.1, 0.2, 0))),), start=4, reach=11)
    np.testing.assert_allclose(seen(fog)[0], (0.3, 0.6, 0), rtol=1e-4)
    everywhere = Fog(Medium(emission=(0.1, 0.2, 0)), start=4, reach=11)
    np.testing.assert_allclose(seen(everywhere)[0], (0.7, 1.4, 0), rtol=1e-4)


def test_a_body_that_is_turned_inside_out_is_the_same():
    found, _ = seen(Fog(bodies=(box(Medium(absorption=(0.2,) * 3), flip=True),)), WHITE)
    np.testing.assert_allclose(found, np.exp(-0.8), rtol=1e-5)


def test_a_camera_in_the_fog_sees_what_is_before_it():
    found, _ = seen(Fog(bodies=(box(Medium(absorption=(0.2,) * 3), (0, 0, 10)),)), WHITE)
    np.testing.assert_allclose(found, np.exp(-0.4), rtol=1e-3)


@pytest.mark.parametrize("density", [0.0, 1e-30, 1e6, 1e30])
def test_extreme_densities_are_numbers(density):
    sun = SunLight("sun", direction=(0, 1, 0), irradiance=(1, 1, 1))
    found, _ = seen(slab(scattering=(density,) * 3, absorption=(density,) * 3), WHITE, (sun,), samples=16)
    expected = 1 if density < 1 else 0.5 + 0.5 / (4 * np.pi)
    np.testing.assert_allclose(found, expected, rtol=0.02)


@pytest.mark.parametrize("size", [(4, 4, 0), (0, 0, 0), (4, 4, 1e-7)])
def test_a_body_without_thickness_holds_nothing(size):
    found, _ = seen(Fog(bodies=(box(Medium(absorption=(5,) * 3), (0, 0, 0), size),)), WHITE)
    np.testing.assert_allclose(found, 1)


def test_an_open_body_holds_nothing_and_is_listed():
    mesh, matrix = cube()
    opened = replace(mesh, triangles=mesh.triangles[:-1], corners=mesh.corners[:-1])
    fog = Fog(bodies=(FogBody("open", opened, matrix, Medium(absorption=(5,) * 3)), box(Medium((0.2,) * 3))))
    np.testing.assert_allclose(seen(fog, WHITE)[0], np.exp(-0.8), rtol=1e-5)
    camera = Camera("PERSP", np.eye(4), (-1, 1, -1, 1), (4, 4), (0, 0, 4, 4))
    listed = {entry["what"]: entry["count"] for entry in trace(Scene(camera, fog=fog), Settings(samples=1)).skipped}
    assert listed["fog of open or flat bodies"] == 1
    assert sorted_out(fog) == ([fog.bodies[1]], ["open"])


def test_however_many_bodies_overlap_rays_are_worked_on_in_parts_to_the_same_bit(monkeypatch):
    sun = SunLight("sun", direction=(0, 0, 1), irradiance=(10, 10, 10))
    fog = Fog(bodies=tuple(box(Medium(scattering=(0.01 * i, 0.1, 0)), (0, 0, i / 100)) for i in range(4)))
    whole, _ = seen(fog, WHITE, (sun,), samples=4)
    sizes, along = [], CompiledFog.along
    monkeypatch.setattr(CompiledFog, "along", lambda self, o, *way: (sizes.append(o.shape[1]), along(self, o, *way))[1])
    monkeypatch.setattr(integrator_fog, "TOGETHER", 90)
    parts, _ = seen(fog, WHITE, (sun,), samples=4)
    assert max(sizes) <= 10 < sum(sizes)
    np.testing.assert_array_equal(parts, whole)


GLASS = Surface(opacity=0.0, reflectivity=0.0, ior=1.5)
MIRROR = Surface(reflectivity=1.0, ambient=0.0, diffuse=0.0)


def test_fog_displaces_no_glass_and_is_not_within_it():
    """A white furnace: what glass reflects and lets through is all of the light, less what the fog around takes."""
    ball = Sphere("ball", (0, 0, 0), 1.0, 0, ray_traced=True)
    clear, _ = seen(None, WHITE, spheres=(ball,), surfaces=(GLASS,))
    fog = slab(absorption=(0.1,) * 3)
    found, _ = seen(fog, WHITE, spheres=(ball,), surfaces=(GLASS,))
    f = (0.5 / 2.5) ** 2
    way = np.exp(-0.1)  # from the box to the ball, and from there on
    inside = (1 - f) ** 2 * way**2 / (1 - f * f) + way**2 * (f + (1 - f) ** 2 * f / (1 - f * f))
    np.testing.assert_allclose(clear, 1, rtol=1e-3)
    np.testing.assert_allclose(found, inside, rtol=1e-3)


def test_a_mirror_shows_the_fog_before_it_twice():
    ball = Sphere("ball", (0, 0, 0), 1.0, 0, ray_traced=True)
    found, _ = seen(slab(absorption=(0.1,) * 3, emission=(0.1,) * 3), WHITE, spheres=(ball,), surfaces=(MIRROR,))
    way = np.exp(-0.1)
    np.testing.assert_allclose(found, (1 - way) * (1 + way) + way**2, rtol=1e-4)


def test_in_a_hybrid_picture_camera_rays_get_only_their_colour_from_fog():
    """EEVEE's half has the glow, and its mask the mean of what gets through."""
    ball = Sphere("ball", (0, 0, 0), 1.0, 0, ray_traced=True)
    wall = Surface(emission=(1.0, 1.0, 1.0), base_color=(0, 0, 0))
    absorption = np.array([0.3, 0.2, 0.1])
    fog = slab(absorption=tuple(absorption), emission=(5,) * 3)
    found, _ = seen(fog, sees="RAY_TRACED", spheres=(ball,), surfaces=(wall,))
    left = np.exp(-absorption)
    np.testing.assert_allclose(found, left / left.mean(), rtol=1e-5)


def test_a_scene_without_fog_compiles_none():
    from hybrid_addon.tracer.prepare.compiled import CompiledScene

    camera = Camera("PERSP", np.eye(4), (-1, 1, -1, 1), (4, 4), (0, 0, 4, 4))
    nothing = Fog(Medium(), (box(Medium()),))
    for fog in (Fog(), nothing):
        compiled = CompiledScene(Scene(camera, world=WHITE, fog=fog), Settings())
        assert compiled.fog is None and not compiled.plan.draws


@pytest.mark.parametrize(
    ("wrong", "what"),
    [
        ({"absorption": (-1, 0, 0)}, "absorption"),
        ({"emission": (np.nan, 0, 0)}, "emission"),
        ({"anisotropy": 1.0}, "a"),
    ],
)
def test_bad_media_are_refused_in_one_line(wrong, what):
    with pytest.raises(ValueError, match=f"fog: {what}"):
        seen(slab(**wrong))
