# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that are kept once, beside the same instances flattened: the same picture, to the last bit."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon import accelerated
from hybrid_addon.scene import Expression, PointLight, Sphere, Visibility, World
from hybrid_addon.tracer import CompiledScene, SceneCache, trace
from hybrid_addon.tracer.core.stats import Stats
from hybrid_addon.tracer.geometry import instanced, trees
from hybrid_addon.tracer.geometry.embree import QUERIES
from hybrid_addon.tracer.geometry.triangles import facets_of
from hybrid_addon.tracer.prepare.footprint import taken, triangles_by_mesh
from hybrid_addon.tracer.render import trace_compiled

READS = "color:C", "tangent:U", "uv:U", "instance:tone", "true_normal", "generated", "around:Z"


@pytest.fixture
def keep(monkeypatch):
    """Say whether meshes are kept once, however few their instances."""

    def set_to(once):
        for limit in ("INSTANCING_FROM", "LEAST_INSTANCED"):
            monkeypatch.setattr(instanced, limit, 1 if once else 1 << 40)

    set_to(True)
    return set_to


def placed(rng, size, mirrored=False):
    """A matrix that turns, stretches by up to e, and moves."""
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    matrix = np.eye(4)
    matrix[:3, :3] = turn * np.sign(np.linalg.det(turn)) * np.exp(rng.uniform(-0.5, 0.5, 3)) * size
    matrix[:3, 0] *= -1 if mirrored else 1
    matrix[:3, 3] = rng.uniform(-2, 2, 3)
    return matrix


@pytest.fixture
def meadow(build):
    """60 balls and boxes, turned, stretched and mirrored, that wear what reads all that a mesh knows; and other things:
    a floor that reads less, an analytic ball, and two balls of glass, which are no instances."""
    rng = np.random.default_rng(4)
    ball, box, glass = build.icosphere(2, smooth=True), build.box(), build.icosphere(2)
    n = len(ball.vertices)
    known = {
        "color:C": rng.random((n, 4)),
        "generated": ball.vertices / 2 + 0.5,
        **{key: np.append(np.roll(ball.vertices, 1, 1), np.ones((n, 1)), 1) for key in ("tangent:U", "around:Z")},
    }
    attributes = {key: data.astype(np.float32) for key, data in known.items()}
    ball = replace(ball, uv_maps={"": ball.vertices[:, :2].copy()}, attributes=attributes)
    box = replace(box, surface_slots=np.arange(12, dtype=np.int32) % 3)
    reading = [build.matte(Expression("attribute", (), key)) for key in READS]
    reading.append(replace(reading[0], emission=Expression("attribute", (), "uv:U")))
    surfaces = [build.matte((0.8, 0.4, 0.3)), build.mirror(0.6), build.glass(), reading[2], *reading]
    instances = []
    for k in range(60):
        wears = (0, 1) if k % 2 else (4 + k // 2 % len(reading),)
        seen = Visibility(camera=k % 7 != 0, shadow=k % 5 != 0, secondary=k % 11 != 0)
        matrix = placed(rng, 0.2 if k % 2 else 0.3, mirrored=k % 3 == 0)
        values = {"tone": (k / 60, 1 - k / 60, 0.5)}
        instances.append(
            build.instance(
                k % 2,
                wears,
                matrix,
                f"thing {k}",
                ray_traced=k % 4 != 0,
                moves=k % 6 == 0,
                visibility=seen,
                values=values,
            )
        )
    for x in (-3.4, 3.4):
        instances.append(
            build.instance(2, 2, build.translation(x, 0, 1) @ np.diag([0.5, 0.5, 0.5, 1]), ray_traced=True)
        )
    instances.append(build.instance(3, 3, build.translation(0, 0, -2.5)))
    corners = np.array([(-6, -6, 0), (6, -6, 0), (6, 6, 0), (-6, 6, 0)], np.float32)
    floor = build.quad(corners, uv_maps={"": corners[:, :2] / 12 + 0.5})
    return replace(
        build.scene(surfaces=surfaces, world=World((0.3, 0.4, 0.5)), camera=build.camera((0, 0, 7), size=(48, 48))),
        meshes=(ball, box, glass, floor),
        instances=tuple(instances),
        lights=(PointLight("lamp", position=(3, 2, 6), intensity=(200, 200, 200)),),
        spheres=(Sphere("sphere", (0, 0, 1), 0.4, 1, ray_traced=True),),
    )


def test_the_picture_is_that_of_flattened_instances(kernels, keep, meadow, build):
    """(No instance's bounds meet a ball of glass: those it would swell into differently.)"""
    settings = replace(build.one_ray, samples=4, passes=frozenset({"depth", "normal"}), adaptive=0.05)
    for scene in (meadow, replace(meadow, camera=build.camera((0.3, 0.2, 0.4), (1, 1, 0), size=(24, 24)))):
        keep(True)
        once = trace(scene, settings)
        keep(False)
        flat = trace(scene, settings)
        assert once.radiance.std() > 0.1 and once.rays == flat.rays
        np.testing.assert_array_equal(once.radiance, flat.radiance)
        for name, values in flat.passes.items():
            np.testing.assert_array_equal(once.passes[name], values)


def test_a_hit_knows_its_instance(kernels, keep, meadow, build):
    found = []
    for once in (True, False):
        keep(once)
        compiled = CompiledScene(meadow, build.one_ray)
        g = compiled.geometry
        _, hits = compiled.shown(np.arange(48 * 48), Stats())
        found.append((g.object[hits.prim], g.surface[hits.prim], hits.t, hits.normal, hits.extent(g)))
        assert (g.instanced is not None) == once
        assert (g.triangle_count < 1000) == once  # glass, which may have to swell, and the floor
    for mine, other in zip(*found, strict=True):
        np.testing.assert_array_equal(mine, other)
    assert len(np.unique(found[0][0])) > 40


def test_memory_is_that_of_one_mesh(kernels, keep, meadow, build):
    ball = build.icosphere(4)
    many = [build.instance(0, 3, build.translation(k % 8, k // 8, 0)) for k in range(40)]
    scene = replace(meadow, meshes=(ball,), instances=tuple(many))
    geometry = CompiledScene(scene, build.one_ray).geometry
    assert taken(scene, geometry, [])["geometry"] < 40 * len(ball.triangles)
    assert triangles_by_mesh(scene)[0] == len(ball.triangles)
    keep(False)
    assert triangles_by_mesh(scene)[0] == 40 * len(ball.triangles)


def test_what_would_be_found_badly_is_flattened(kernels, keep, meadow, build):
    """Matrices that stretch much or that are no numbers, and meshes of few triangles."""
    ball, stretch = build.icosphere(1), np.diag([1, 1, 30.0, 1])
    bad = [stretch, np.diag([1, 1, 0.0, 1]), np.diag([1, np.nan, 1, 1]), build.translation(1e19, 0, 0)]
    matrices = [np.eye(4), build.translation(3, 0, 0), *bad]
    scene = replace(meadow, meshes=(ball,), instances=tuple(build.instance(0, 3, m) for m in matrices))
    geometry = CompiledScene(scene, build.one_ray).geometry
    assert geometry.instanced is not None and len(geometry.instanced.mesh) == 2
    assert set(np.unique(geometry.object[: geometry.triangle_count])) == {2, 3}  # of the flat one what is left
    keep(False)
    assert CompiledScene(scene, build.one_ray).geometry.instanced is None


def test_a_kernel_that_fails_in_the_middle_is_one_warning_and_the_same_picture(
    kernels, keep, meadow, build, monkeypatch
):
    """embreex is given the triangles of all instances then."""
    scene = CompiledScene(meadow, replace(build.one_ray, threads=2))
    scene.build_all()
    wanted, asked = trace_compiled(scene), []
    monkeypatch.setattr(accelerated, "_failed", {})
    monkeypatch.setattr(accelerated, "_warned", [])
    for name in QUERIES:
        twins = accelerated.ALL[name]
        works = twins.compiled

        def fails(*args, works=works):
            asked.append(1)
            if len(asked) > 3:
                raise ZeroDivisionError("no luck")
            return works(*args)

        monkeypatch.setattr(twins, "kernel", fails)
        monkeypatch.setattr(twins, "compiled", works)
    with pytest.warns(UserWarning, match="the compiled kernel .* failed, numpy does its work") as told:
        found = trace_compiled(scene)
    assert len(told) == 1 and scene.geometry.instanced is not None
    np.testing.assert_array_equal(found.radiance, wanted.radiance)


def test_without_kernels_all_is_flattened(keep, meadow, build):
    assert CompiledScene(meadow, build.one_ray).geometry.instanced is None


def test_a_tiny_instance_far_away_has_a_normal(kernels, keep, build):
    """Its corners are rounded onto one another."""
    ball = build.icosphere(1)
    matrices = [build.translation(9e6, 0, 0) @ np.diag([1e-3, 1e-3, 1e-3, 1]), build.translation(-9e6, 0, 0)]
    scene = replace(build.scene(surfaces=[build.matte()]), meshes=(ball,))
    scene = replace(scene, instances=tuple(build.instance(0, 0, m) for m in matrices))
    geometry = CompiledScene(scene, build.one_ray).geometry
    table, place = geometry.faces_of(np.arange(80, dtype=np.int64))
    lost = ~facets_of(geometry.instanced.points(np.zeros(80, int), np.arange(80)))[3]
    normal, outward = table.facets[place, :3], ball.vertices[ball.triangles].mean(axis=1)
    assert lost.any() and ((normal * outward).sum(axis=1)[lost] > 0.9).all()
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1, atol=1e-6)


def scattered(build, mesh, worn, surfaces, *others, places=4):
    """Instances of a mesh in a row, and others."""
    row = [build.instance(0, worn, build.translation(1.5 * k - 2.25, 0, 0), ray_traced=True) for k in range(places)]
    meshes, more = (
        (mesh, *(m for m, *_ in others)),
        [build.instance(k, s, ray_traced=True) for k, (_, s) in enumerate(others, 1)],
    )
    scene = build.scene(surfaces=surfaces, camera=build.camera((0, 1, 7), size=(32, 32)), world=World((0.3, 0.4, 0.5)))
    lamp = PointLight("lamp", position=(3, 2, 6), intensity=(200, 200, 200))
    return replace(scene, meshes=meshes, instances=(*row, *more), lights=(lamp,))


def same_picture(keep, scene, settings, atol=0):
    """The geometry with meshes kept once; the picture is that of flattened ones."""
    keep(False)
    flat = trace(scene, settings)
    keep(True)
    once = trace(scene, settings)
    np.testing.assert_allclose(once.radiance, flat.radiance, rtol=0, atol=atol)
    return once, CompiledScene(scene, settings).geometry


def test_an_air_bubble_is_a_solid_and_a_leaf_is_not(kernels, keep, build):
    """Once something refracts, closed bodies that do not are solids, too: they displace the water."""
    surfaces = [build.glass(1.0), build.glass(1.33), build.matte(opacity=0.5, ior=1.0)]
    ball, leaf = build.icosphere(2, 0.4), build.quad([(-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0)])
    sea = build.box((-4, -1, -1), (4, 1, 0.5))
    for mesh, worn in (ball, 0), (leaf, 2), (leaf, 1):
        scene = scattered(build, mesh, worn, surfaces, (sea, 1))
        once, geometry = same_picture(keep, scene, build.one_ray, atol=1e-6)  # the sea swells more for leaves in it
        assert once.radiance.std() > 0
        assert (geometry.instanced is None) == (mesh is ball)
        assert triangles_by_mesh(scene)[0] == len(mesh.triangles) * (4 if mesh is ball else 1)


def test_a_slot_that_no_triangle_wears_is_in_no_set(kernels, keep, build):
    """Alpha leaves in the second slot: of what is opaque there is nothing."""
    ball = build.icosphere(1)
    leaf = replace(ball, surface_slots=np.ones(len(ball.triangles), np.int32))
    surfaces = [build.matte(), build.matte((0.2, 0.7, 0.1), opacity=0.5, ior=1.0)]
    settings = replace(build.one_ray, occlusion_samples=1)
    once, geometry = same_picture(keep, scattered(build, leaf, (0, 1), surfaces), settings)
    assert geometry.instanced is not None and once.radiance.std() > 0


def test_meshes_without_a_sound_triangle_are_nothing(kernels, keep, build):
    line = build.mesh([(0, 0, 0), (1, 0, 0), (0.5, 0, 0)], [(0, 1, 2)] * 2)
    once, geometry = same_picture(keep, scattered(build, line, 0, [build.matte()]), build.one_ray)
    assert geometry.instanced.stride == 0 and not np.ptp(once.radiance, axis=(0, 1)).any()


def test_a_mesh_has_one_tree_for_all_sets_and_none_of_flattened_triangles(kernels, keep, build, monkeypatch):
    """A ball about the origin is flattened to what its mesh is: in the next frame that tree is no instance's."""
    built = []

    class Counted(trees.Triangles):
        def __init__(self, *arrays):
            built.append(len(arrays[1]))
            super().__init__(*arrays)

    monkeypatch.setattr(trees, "Triangles", Counted)
    scene = scattered(build, build.icosphere(1), 0, [build.matte()])
    seen = Visibility(shadow=False)
    scene = replace(scene, instances=(*scene.instances[1:], replace(scene.instances[0], visibility=seen)))
    alone, cache = replace(scene, instances=(replace(scene.instances[1], matrix_world=np.eye(4)),)), SceneCache()
    keep(False)
    trace(alone, build.one_ray, cache=cache)
    keep(True)
    for kept in (cache, None):
        built.clear()
        found = trace(scene, build.one_ray, cache=kept)
        assert built == [80] and found.radiance.std() > 0
