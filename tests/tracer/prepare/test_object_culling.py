"""Objects that no ray can meet are left out, and only those."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import AreaLight, Lens, PointLight, Settings, Sphere, SpotLight, SunLight, Visibility, World
from hybrid_addon.tracer import CompiledScene, trace
from hybrid_addon.tracer.emitters.lights import compile_lights
from hybrid_addon.tracer.geometry.swept_boxes import OUTWARD, SweptBoxes
from hybrid_addon.tracer.prepare.object_culling import _from_camera
from hybrid_addon.tracer.prepare.plan import describe

SETTINGS = Settings(samples=2, threads=1, max_depth=3)
OCCLUDED = replace(SETTINGS, occlusion_samples=2, occlusion_distance=0.7)
EVERYTHING = frozenset({"unmet"})
UNFLAGGED = {"ray_traced": False}
LAMP = PointLight("lamp", (0, 0, 4), (30, 30, 30))
SKY = World((0.2, 0.3, 0.4))


def left_out(scene, settings=SETTINGS):
    return next(row["saved"] or 0 for row in describe(scene, settings).table() if row["name"] == "unmet")


def same_without(scene, settings=SETTINGS):
    """How many are left out; and that the picture is the same with them."""
    film, whole = trace(scene, settings), trace(scene, replace(settings, keep=EVERYTHING))
    for name in ("radiance", "coverage", "residual"):
        np.testing.assert_array_equal(getattr(film, name), getattr(whole, name))
    return left_out(scene, settings)


# ------------------------------------------------------------------------------------------------ geometry


def boxes_of(rng, number, reach=3.0):
    middle, half = rng.uniform(-reach, reach, (number, 1, 3)), rng.uniform(0, 0.6, (number, 1, 3))
    return middle + half * OUTWARD


def between(rng, box, n):
    return rng.uniform(box[0], box[1], (n, 3))


def test_a_way_touches_what_segments_between_its_boxes_meet():
    """From random places of one box to random places of another, walked in small steps: against the closed form."""
    rng, found = np.random.default_rng(1), []
    for _ in range(60):
        start, end = boxes_of(rng, 2)
        others = boxes_of(rng, 40)
        a, b = between(rng, start, 400), between(rng, end, 400)
        corners = np.array(np.meshgrid(*start.T)).reshape(3, -1).T
        a[:8], b[:8] = corners, np.array(np.meshgrid(*end.T)).reshape(3, -1).T
        walk = (a + np.linspace(0, 1, 60)[:, None, None] * (b - a)).reshape(-1, 1, 3)
        met = ((walk >= others[:, 0]) & (walk <= others[:, 1])).all(axis=2).any(axis=0)
        touched = SweptBoxes(start[None], (end - start)[None], 1.0).touch(others)[0]
        assert not (met & ~touched).any()
        found += [(met & touched).sum(), touched.sum()]
    assert sum(found[::2]) > 0.8 * sum(found[1::2])  # and hardly anything else: the closed form is tight


def lights(rng):
    place = tuple(rng.uniform(-5, 5, 3))
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    yield PointLight("point", place, (9, 9, 9))
    yield PointLight("disk", place, (9, 9, 9), radius=0.7)
    yield PointLight("ball", place, (9, 9, 9), radius=0.7, soft_falloff=False)
    yield SpotLight("spot", place, (9, 9, 9), radius=0.3, cos_cone=0.0, world_to_light=np.eye(3))
    yield SunLight("sun", tuple(direction), (3, 3, 3))
    yield SunLight("soft sun", tuple(direction), (3, 3, 3), angle=0.8)
    yield AreaLight("area", place, tuple(direction), (0.9, 0.2, 0), (0, 0.3, 0.8), (9, 9, 9))


def test_shadow_rays_stay_on_their_ways():
    """Those that the lights themselves give, to random points of their shapes."""
    rng = np.random.default_rng(2)
    for _ in range(20):
        start = boxes_of(rng, 1)
        for light in lights(rng):
            (compiled,) = compile_lights([light], np.zeros(3), np.zeros(0, np.intp))
            origin = between(rng, start[0], 300).T.astype(np.float32)
            square = tuple(rng.random((2, 300), np.float32))
            normal = np.broadcast_to(np.float32([[0], [0], [1]]), origin.shape)
            wi, distance = compiled.shadow_rays(origin, normal, square if compiled.is_soft else None)
            along = rng.random(300) * np.where(np.isfinite(distance), distance, 20)
            points = (origin + wi * along).T[:, None] + 1e-5 * OUTWARD
            assert compiled.swept_boxes(start).touch(points).all(), light.name


@pytest.mark.parametrize("projection", ["PERSP", "ORTHO"])
@pytest.mark.parametrize("lens", [None, Lens(0.4, 4.0)])
def test_camera_rays_stay_on_their_ways(build, projection, lens):
    """Nothing stands in the camera's way to a ray traced wall but what the picture needs: see the count of samples."""
    camera = build.camera((1, -6, 2), (0, 0, 0), (0, 0, 1), size=(24, 24), projection=projection, lens=lens)
    if projection == "ORTHO":
        camera = replace(camera, view_plane=(-3, 3, -3, 3))
    rng, total = np.random.default_rng(3), 0
    for _ in range(6):
        boxes = [(build.box(low, high), build.matte(), UNFLAGGED) for low, high in boxes_of(rng, 30, 4.0)]
        wall = build.quad([(-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1)])
        total += same_without(build.scene((wall, build.matte()), *boxes, camera=camera, world=SKY))
    assert total > 30
    assert _from_camera(np.zeros((1, 2, 3)), camera).touch(np.array([[[1, -6, 2], [1, -6, 2]]])).any()


# ------------------------------------------------------------------------------------------------ pictures


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", ["matte", "mirror", "smooth"])
def test_what_is_left_out_changes_no_bit(build, kind, seed):
    """A ray traced quad or ball among boxes, with one light of each kind in turn."""
    rng, total = np.random.default_rng(seed), 0
    quad = build.quad([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    ray_traced = {
        "matte": (quad, build.matte()),
        "mirror": (quad, build.mirror(0.7), {"matrix": turned(rng)}),
        "smooth": (build.icosphere(1, 1.0, smooth=True), build.matte()),
    }[kind]
    camera = build.camera(tuple(rng.uniform(2, 5, 3)), (0, 0, 0), (0, 0, 1), size=(24, 24))
    for light in lights(rng):
        boxes = [(build.box(low, high), build.matte(), UNFLAGGED) for low, high in boxes_of(rng, 40, 6.0)]
        total += same_without(build.scene(ray_traced, *boxes, lights=(light,), camera=camera, world=SKY), OCCLUDED)
    assert total > 20


def turned(rng):
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    m = np.eye(4)
    m[:3, :3] = q
    return m


def mirror_scene(build, *parts, **other):
    """A ray traced mirror that faces the camera, looked at from above: it shows what stands at +z."""
    mirror = build.quad([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    camera = build.camera((0, 0, 3), size=(16, 16))
    return build.scene((mirror, build.mirror()), *parts, camera=camera, **other)


def cube(build, x, y, z, surface=None):
    low, high = (x - 0.2, y - 0.2, z - 0.2), (x + 0.2, y + 0.2, z + 0.2)
    return build.box(low, high), surface or build.matte(), UNFLAGGED


def test_a_flat_mirror_needs_what_it_can_show(build):
    """Its virtual camera is 3 below: at the height z it shows what is within (z + 3) / 3 across, and nothing behind."""
    needed = cube(build, 1.5, 0, 2), cube(build, 0, -2.3, 5)
    needless = cube(build, 2.0, 0, 2), cube(build, 0, 0, -1)
    assert left_out(mirror_scene(build, *needed)) == 0
    assert left_out(mirror_scene(build, *needed, *needless)) == 2
    assert same_without(mirror_scene(build, *needed, *needless, world=SKY)) == 2


def test_what_a_mirror_shows_is_lit_past_all_that_is_in_the_way(build):
    shown, far = cube(build, 1.5, 0, 2), cube(build, 5, 0, 2)
    lamp = PointLight("lamp", (9, 0, 2), (90, 90, 90))
    assert left_out(mirror_scene(build, shown, far)) == 1
    assert left_out(mirror_scene(build, shown, far, lights=(lamp,))) == 0
    assert left_out(mirror_scene(build, shown, far, lights=(replace(lamp, cast_shadow=False),))) == 1
    assert same_without(mirror_scene(build, shown, far, lights=(lamp,))) == 0


def test_where_rays_go_everywhere_everything_is_needed(build):
    far, ball = cube(build, 0, 0, -9), build.icosphere(2, 0.3)
    flat = mirror_scene(build, far)
    assert left_out(flat) == 1
    assert left_out(replace(flat, spheres=(Sphere("ball", (0, 0, 1), 0.2, 0, True),))) == 0  # a curved mirror
    assert left_out(mirror_scene(build, far, (ball, build.glass(), UNFLAGGED))) == 0
    assert left_out(mirror_scene(build, far, (ball, build.mirror(), {"matrix": build.translation(0, 0, 1)}))) == 0
    shown = cube(build, 0, 0, 4, build.mirror())
    assert left_out(mirror_scene(build, far, shown)) == 0  # a mirror in a mirror
    assert left_out(mirror_scene(build, far, shown), replace(SETTINGS, max_depth=1)) == 1  # that far rays do not go
    assert (
        left_out(flat, replace(SETTINGS, camera_sees="ALL"))
        == left_out(flat, replace(SETTINGS, raster_shadows=True))
        == 0
    )
    assert left_out(replace(flat, world=SKY), replace(OCCLUDED, occlusion_distance=np.inf)) == 0


def test_two_mirrors_that_do_not_see_each_other(build):
    """Side by side they do not; across from each other they do."""
    far = cube(build, 0, 0, -9)
    beside = build.quad([(1.5, -1, 0), (3, -1, 0), (3, 1, 0), (1.5, 1, 0)])
    across = build.quad([(-1, -1, 2), (-1, 1, 2), (1, 1, 2), (1, -1, 2)])
    assert same_without(mirror_scene(build, far, (beside, build.mirror()))) == 1
    assert same_without(mirror_scene(build, far, (across, build.mirror()))) == 0


def test_a_folded_mirror_is_not_flat(build):
    far = cube(build, 0, 0, -9)
    fold = [(-1, -1, 0), (0, -1, 0), (0, 1, 0), (-1, 1, 0), (1, -1, 0.1), (1, 1, 0.1)]
    triangles = [(0, 1, 2), (0, 2, 3), (1, 4, 5), (1, 5, 2)]
    camera = build.camera((0, 0, 3))
    folded = build.scene((build.mesh(np.float32(fold), triangles), build.mirror()), far, camera=camera)
    assert left_out(folded) == 0
    flat = build.mesh(np.float32(fold) * [1, 1, 0], triangles)
    assert left_out(build.scene((flat, build.mirror()), far, camera=camera)) == 1


def test_what_is_invisible_to_rays_is_not_met_by_them(build):
    behind = build.box((-0.2, -0.2, -2), (0.2, 0.2, -1)), build.matte()
    scene = mirror_scene(build, cube(build, 0, 0, 5))
    unseen = replace(scene.instances[1], visibility=Visibility(camera=True, shadow=True, secondary=False))
    assert left_out(scene) == 0 and left_out(replace(scene, instances=(scene.instances[0], unseen))) == 1
    ray_traced = mirror_scene(build, (*behind, {"visibility": Visibility(camera=False)}))
    assert left_out(ray_traced) == 0  # ray traced objects stay, whatever rays do


def test_several_pictures_of_a_compiled_scene_need_everything(build):
    """Another camera may look elsewhere."""
    scene = mirror_scene(build, cube(build, 0, 0, -9), world=SKY)
    compiled = CompiledScene(scene, SETTINGS)
    assert not compiled.plan.applies["unmet"] and len(set(compiled.geometry.object)) == 2
    once = CompiledScene(scene, SETTINGS, once=True)
    assert once.plan.applies["unmet"] and len(set(once.geometry.object)) == 1


def test_smooth_triangles_lift_their_shadow_rays(build):
    """From a quad that is smooth as half a ball, a ray to a low lamp passes well above the line from it to the lamp."""
    corners = np.float32([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    normals = np.add(corners, (0, 0, 1)) / np.sqrt(3)
    bulging = replace(build.quad(corners), normals=normals.astype(np.float32))
    wall = build.box((1.5, -2, 0.3), (1.6, 2, 0.9)), build.matte(), UNFLAGGED
    lamp = PointLight("lamp", (12, 0, 0.3), (900, 900, 900))
    scene, bare = (build.scene((bulging, build.matte()), *parts, lights=(lamp,)) for parts in ((wall,), ()))
    assert (trace(scene, SETTINGS).radiance != trace(bare, SETTINGS).radiance).any()
    assert same_without(scene) == 0
