# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes that must not change the picture; those marked exact not by one bit."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import (
    AreaLight,
    Expression,
    Instance,
    Plane,
    PointLight,
    Settings,
    Sphere,
    SpotLight,
    SunLight,
    Surface,
    Texture,
    World,
)
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.film.filter import grow


@pytest.fixture(scope="module")
def everything(build):
    """A little of all: glass, mirror, highlight, texture, every kind of light, analytic shapes, an environment."""
    rng = np.random.default_rng(5)
    checker = Texture("t", rng.random((8, 8, 4)).astype(np.float32))
    sky = Texture("sky", rng.random((8, 16, 4)).astype(np.float32))
    uvs = {"": np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32)}
    floor = build.quad([(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)], uv_maps=uvs)
    s = build.scene(
        (floor, Surface(base_color=Expression("image", (), checker), reflectivity=0.125)),
        (build.icosphere(2, 0.5, smooth=True), build.glass(1.5), {"matrix": build.translation(0.5, -0.5, 0.625)}),
        (build.box((-1, 0, 0.125), (-0.25, 1, 1)), Surface(specular=(0.25, 0.5, 0.5), roughness=0.375)),
        (build.quad([(1, 1, 0.5), (2, 1, 0.5), (2, 1, 1.5), (1, 1, 1.5)]), build.mirror(0.75)),
        camera=build.camera((0.5, -4, 2), (0, 0, 0.5), (0, 0, 1), (40, 30), 0.5),
        lights=(
            PointLight("p", (1, -1, 2), (2, 2, 2), radius=0.125),
            SpotLight("s", (-2, -1, 3), (5, 4, 3), range=8.0, world_to_light=np.eye(3)),
            SunLight("sun", (0.5, 0.25, 1), (0.5, 0.5, 0.5)),
            AreaLight("a", (0, 1, 3), (0, 0, -1), (0.5, 0, 0), (0, 0.25, 0), (2, 1, 1), range=16.0),
        ),
        world=World((0.5, 0.5, 0.5), sky),
    )
    shapes = (Sphere("ball", (-0.5, -1, 0.25), 0.25, 1, ray_traced=True),)
    return replace(s, spheres=shapes, planes=(Plane("ground", (0, 0, -0.5), (0, 0, 1), 2),))


SETTINGS = Settings(samples=4, camera_sees="ALL", threads=1, max_depth=5)


@pytest.fixture(scope="module")
def reference(everything):
    return trace(everything, SETTINGS)


def assert_same(film, reference):
    np.testing.assert_array_equal(film.radiance, reference.radiance)
    np.testing.assert_array_equal(film.coverage, reference.coverage)
    np.testing.assert_array_equal(film.residual, reference.residual)


def test_the_reference_is_worth_comparing(reference):
    assert not any(reference.invariants.values()), reference.invariants
    assert all(reference.rays[kind] > 100 for kind in ("camera", "reflected", "refracted", "shadow"))
    assert reference.radiance.std() > 0.05


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("chunk", [1, 40, 333, 1 << 14])
def test_threads_and_chunks_exact(everything, reference, threads, chunk):
    if chunk == 1:  # slow: one pixel at a time
        everything = replace(everything, camera=replace(everything.camera, window=(16, 12, 22, 16)))
        film = trace(everything, replace(SETTINGS, threads=threads, chunk=chunk))
        np.testing.assert_array_equal(film.radiance, reference.radiance[12:16, 16:22])
        return
    assert_same(trace(everything, replace(SETTINGS, threads=threads, chunk=chunk)), reference)


def test_a_render_border_is_a_part_of_the_whole_exact(everything, reference):
    border = replace(everything, camera=replace(everything.camera, window=(7, 3, 29, 21)))
    np.testing.assert_array_equal(trace(border, SETTINGS).radiance, reference.radiance[3:21, 7:29])


def test_a_mask_does_not_change_what_is_traced_exact(everything, reference):
    """Where the pixels around are in the mask, too: their samples count."""
    mask = np.zeros((30, 40), np.float32)
    mask[5:20, 8:31] = np.random.default_rng(0).random((15, 23)) > 0.15
    film = trace(everything, SETTINGS, mask=mask)
    inner = ~grow(mask == 0, 1)
    assert inner.sum() > 50
    np.testing.assert_array_equal(film.radiance[inner], reference.radiance[inner])
    assert (film.radiance[mask == 0] == 0).all() and (film.coverage[mask == 0] == 0).all()
    assert film.rays["camera"] == np.count_nonzero(mask) * 4


def scaled(scene, s):
    """The whole scene s times as large; point lights s^2 times as strong, so that nothing changes to the eye."""

    def matrix(m, scale_axes):
        m = m.copy()
        m[:3, :4] *= s
        if not scale_axes:
            m[:3, :3] /= s
        return m

    def light(one):
        if isinstance(one, SunLight):
            return one
        place = {"position": tuple(s * np.array(one.position)), "range": s * one.range}
        if isinstance(one, AreaLight):
            return replace(one, axis_u=tuple(s * np.array(one.axis_u)), axis_v=tuple(s * np.array(one.axis_v)), **place)
        return replace(one, intensity=tuple(s * s * np.array(one.intensity)), radius=s * one.radius, **place)

    cam = scene.camera
    return replace(
        scene,
        camera=replace(
            cam, matrix_world=matrix(cam.matrix_world, False), clip_start=s * cam.clip_start, clip_end=s * cam.clip_end
        ),
        instances=tuple(replace(i, matrix_world=matrix(i.matrix_world, True)) for i in scene.instances),
        spheres=tuple(replace(b, center=tuple(s * np.array(b.center)), radius=s * b.radius) for b in scene.spheres),
        planes=tuple(replace(p, point=tuple(s * np.array(p.point))) for p in scene.planes),
        lights=tuple(light(one) for one in scene.lights),
    )


@pytest.mark.parametrize("power", [-14, -13, -6, -3, -1, 1, 5, 12, 20, 23])
def test_scaling_by_a_power_of_two_exact(everything, reference, power):
    assert_same(trace(scaled(everything, 2.0**power), SETTINGS), reference)


@pytest.mark.parametrize("scale", [1e-4, 3.0, 1e4, 1e7])
def test_scaling_by_anything_else(everything, reference, scale):
    film = trace(scaled(everything, scale), SETTINGS)
    assert not any(film.invariants.values())
    off = np.abs(film.radiance - reference.radiance).max(2) > 1e-4
    assert off.mean() < 0.03  # what is left are samples on edges


def moved(scene, offset):
    offset = np.array(offset, float)

    def matrix(m):
        m = m.copy()
        m[:3, 3] += offset
        return m

    def place(p):
        return tuple(np.array(p) + offset)

    return replace(
        scene,
        camera=replace(scene.camera, matrix_world=matrix(scene.camera.matrix_world)),
        instances=tuple(replace(i, matrix_world=matrix(i.matrix_world)) for i in scene.instances),
        spheres=tuple(replace(b, center=place(b.center)) for b in scene.spheres),
        planes=tuple(replace(p, point=place(p.point)) for p in scene.planes),
        lights=tuple(
            one if isinstance(one, SunLight) else replace(one, position=place(one.position)) for one in scene.lights
        ),
    )


@pytest.mark.parametrize("offset", [(1024, -2048, 512), (1e3, 1e6, -1e6)])
def test_far_from_the_origin(everything, reference, offset):
    # The textured sphere of spherical coordinates is not in the scene: only planes have world-bound textures.
    film = trace(moved(everything, offset), SETTINGS)
    assert not any(film.invariants.values())
    off = np.abs(film.radiance - reference.radiance).max(2) > 1e-6
    assert off.mean() < 0.02  # edges of things, and of the texture's texels


def test_brighter_lights_scale_the_picture_exact(everything):
    s = replace(everything, world=World())
    brighter = tuple(
        replace(one, **{k: tuple(8 * np.array(getattr(one, k)))})
        for one in s.lights
        for k in ("intensity", "irradiance", "radiance")
        if hasattr(one, k)
    )
    np.testing.assert_array_equal(
        trace(replace(s, lights=brighter), SETTINGS).radiance, 8 * trace(s, SETTINGS).radiance
    )


def test_lights_superpose(everything):
    s = replace(everything, world=World())
    together = trace(s, SETTINGS).radiance
    apart = sum(trace(replace(s, lights=(one,)), SETTINGS).radiance for one in s.lights)
    np.testing.assert_allclose(apart, together, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("smooth", [False, True])
def test_a_mirrored_instance_is_the_realised_mirrored_mesh_exact(build, smooth):
    ball = build.icosphere(2, 1, smooth)
    squashed = replace(ball, vertices=ball.vertices * np.float32([1, 0.5, 0.75]))
    if smooth:
        n = ball.normals / np.float32([1, 0.5, 0.75])
        squashed = replace(squashed, normals=n / np.linalg.norm(n, axis=1, keepdims=True))
    realised = replace(
        squashed,
        vertices=squashed.vertices * np.float32([-1, 1, 1]),
        normals=None if not smooth else squashed.normals * np.float32([-1, 1, 1]),
        triangles=squashed.triangles[:, [0, 2, 1]],
        corners=squashed.corners[:, [0, 2, 1]],
    )
    s = build.scene(
        camera=build.camera((1, -2, 3), up=(0, 0, 1)),
        lights=(PointLight("p", (2, -1, 3), (9, 9, 9)),),
        surfaces=(Surface(opacity=0.5, ior=1.4, reflectivity=0.25),),
        world=World((0.2, 0.3, 0.4)),
    )
    a = trace(replace(s, meshes=(squashed,), instances=(Instance("i", 0, np.diag([-1.0, 1, 1, 1]), (0,)),)), SETTINGS)
    b = trace(replace(s, meshes=(realised,), instances=(Instance("i", 0, np.eye(4), (0,)),)), SETTINGS)
    np.testing.assert_allclose(a.radiance, b.radiance, atol=1e-7 if smooth else 0)


def test_many_instances_are_the_realised_mesh_exact(build):
    s = build.scene(lights=(PointLight("p", (2, -1, 3), (9, 9, 9)),), surfaces=(build.matte(), build.matte((1, 0, 0))))
    ball = build.icosphere(1, 0.5)
    places = [(x, y, 0.25 * x) for x in (-1, 0, 1) for y in (-1, 0, 1)]
    many = replace(
        s,
        meshes=(ball,),
        instances=tuple(build.instance(0, i % 2, build.translation(*p)) for i, p in enumerate(places)),
    )
    shifted = [replace(ball, vertices=(ball.vertices.astype(float) + p).astype(np.float32)) for p in places]
    realised = replace(s, meshes=tuple(shifted), instances=tuple(build.instance(i, i % 2) for i in range(len(places))))
    np.testing.assert_allclose(trace(many, SETTINGS).radiance, trace(realised, SETTINGS).radiance, atol=1e-6)
