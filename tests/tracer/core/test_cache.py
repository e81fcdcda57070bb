# SPDX-License-Identifier: GPL-3.0-or-later
"""What a frame leaves for the next: the picture is the one of a fresh start, bit for bit, and only the rest is made."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import (
    Expression,
    Fog,
    FogBody,
    Medium,
    PointLight,
    Scene,
    Settings,
    Surface,
    Texture,
    Visibility,
    World,
    WorldSun,
)
from hybrid_addon.tracer import SceneCache, trace
from hybrid_addon.tracer.core.cache import key_of
from hybrid_addon.tracer.emitters.world import CompiledWorld
from hybrid_addon.tracer.geometry import embree, trees
from hybrid_addon.tracer.geometry.flatten import flatten
from hybrid_addon.tracer.media.fog import CompiledFog

SETTINGS = Settings(samples=2, threads=1, max_depth=4)
LAMP = PointLight("p", (1, -2, 4), (20, 20, 20))
ROUGH = Surface("rough", layered=True, specular=(0.04, 0.04, 0.04), roughness=0.6, reflectivity=0.0)
SKY = Texture("sky", np.random.default_rng(3).random((16, 32, 4), np.float32))


def start(build) -> Scene:
    """A glass ball and a mirror on a floor, beside a rough box under a sky; the box is likely to move."""
    floor = build.quad([(-9, -9, -1), (9, -9, -1), (9, 9, -1), (-9, 9, -1)])
    return build.scene(
        (build.icosphere(2, 0.8, smooth=True), build.glass()),
        (build.box((1, -1, -1), (2, 0.3, 1)), build.mirror(0.5)),
        (floor, build.matte(), {"ray_traced": False}),
        (build.box((-2, 0, -1), (-1, 1, 0)), ROUGH, {"ray_traced": False, "moves": True}),
        lights=(LAMP,),
        world=World((0.2, 0.3, 0.4), SKY, sun=WorldSun(0.35)),
    )


def with_world(scene: Scene, **changes) -> Scene:
    return replace(scene, world=replace(scene.world, **changes))


def with_instance(scene: Scene, number: int, **changes) -> Scene:
    instances = list(scene.instances)
    instances[number] = replace(instances[number], **changes)
    return replace(scene, instances=tuple(instances))


def moved(scene: Scene, number: int, x: float) -> Scene:
    matrix = np.array(scene.instances[number].matrix_world)
    matrix[0, 3] += x
    return with_instance(scene, number, matrix_world=matrix)


def edited(scene: Scene) -> Scene:
    mesh = scene.meshes[0]
    return replace(scene, meshes=(replace(mesh, vertices=mesh.vertices * np.float32(1.1)), *scene.meshes[1:]))


def deleted(scene: Scene) -> Scene:
    return replace(scene, instances=scene.instances[1:])


def recoloured(scene: Scene) -> Scene:
    surfaces = tuple(replace(s, base_color=(0.1, 0.5, 0.2), ior=1.3) for s in scene.surfaces)
    return replace(scene, surfaces=surfaces)


def rougher(scene: Scene) -> Scene:
    return replace(scene, surfaces=tuple(replace(s, roughness=0.9) if s is ROUGH else s for s in scene.surfaces))


CHANGES = {
    "nothing": lambda s: s,
    "what moves moved": lambda s: moved(s, 3, 0.1),
    "a ray traced object moved": lambda s: moved(s, 1, 0.25),
    "a ray traced object that moves moved": lambda s: moved(with_instance(s, 1, moves=True), 1, 0.25),
    "a ray traced object far away": lambda s: moved(s, 1, 25),
    "a mesh edited": edited,
    "a surface changed": recoloured,
    "an object deleted": deleted,
    "a flag gone": lambda s: with_instance(s, 1, ray_traced=False),
    "hidden from the camera": lambda s: with_instance(s, 1, visibility=Visibility(camera=False)),
    "another camera": lambda s: replace(s, camera=replace(s.camera, view_plane=(-0.4, 0.6, -0.4, 0.6))),
    "the sky is turned": lambda s: with_world(s, rotation=np.eye(3)[[1, 0, 2]] * ((1,), (-1,), (1,))),
    "the sky is brighter": lambda s: with_world(s, radiance=(0.2, 0.5, 0.4)),
    "another sky": lambda s: with_world(s, environment=replace(SKY, pixels=SKY.pixels[::-1])),
    "a backdrop": lambda s: with_world(s, backdrop=World((1, 0, 1))),
    "another sun": lambda s: with_world(s, sun=WorldSun(0.3, 0.2)),
    "a rougher surface": rougher,
    "a light moved": lambda s: replace(s, lights=(replace(LAMP, position=(3, 2, 4)),)),
}  # fmt: skip


def same(a, b):
    for name in ("radiance", "coverage", "residual"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
    assert a.rays == b.rays


def found(film):
    return {entry["what"]: entry["count"] for entry in film.skipped if "unchanged" in entry["why"]}


@pytest.fixture(params=[False, True], ids=["one tree", "two trees"])
def divided(request, monkeypatch):
    monkeypatch.setattr(trees, "BUILD_SECONDS", 1.0 if request.param else 0.0)
    return request.param


@pytest.fixture(scope="module")
def fresh(build):
    """Of the scene that every change begins with, with one tree and with two."""
    films = {}

    def film(divided):
        if divided not in films:
            films[divided] = trace(start(build), SETTINGS)
        return films[divided]

    return film


@pytest.mark.once
@pytest.mark.parametrize("change", CHANGES)
def test_a_changed_scene_looks_as_from_a_fresh_start(build, change, divided, fresh):
    """There and back again: each frame finds what the one before has left."""
    cache, first = SceneCache(), start(build)
    changed = CHANGES[change](first)
    same(trace(first, SETTINGS, cache=cache), fresh(divided))
    same(trace(changed, SETTINGS, cache=cache), trace(changed, SETTINGS))
    same(trace(first, SETTINGS, cache=cache), fresh(divided))


def test_only_what_moved_is_made_ready_and_built(build, divided, monkeypatch):
    cache, scene = SceneCache(), start(build)
    trace(scene, SETTINGS, cache=cache)
    built, init = [], embree.TriangleScene.__init__
    monkeypatch.setattr(embree.TriangleScene, "__init__", lambda self, *a: (init(self, *a), built.append(self.size))[0])
    film = trace(moved(scene, 3, 0.1), SETTINGS, cache=cache)
    everything = sum(len(scene.meshes[i.mesh].triangles) for i in scene.instances)
    box = len(scene.meshes[scene.instances[3].mesh].triangles)
    assert found(film)["triangles prepared"] == everything - box
    assert film.plan[2]["name"] == "unchanged" and film.plan[2]["applies"]
    assert set(built) <= {0, box} if divided else everything in built
    built.clear()
    film = trace(moved(scene, 3, 0.1), replace(SETTINGS, samples=4), cache=cache)
    assert found(film)["triangles prepared"] == everything and not any(built)


def test_an_unchanged_world_is_kept(build, monkeypatch):
    cache, scene = SceneCache(), start(build)
    trace(scene, SETTINGS, cache=cache)
    made, init = [], CompiledWorld.__init__
    monkeypatch.setattr(CompiledWorld, "__init__", lambda self, *a: (made.append(1), init(self, *a))[1])
    sky = replace(SKY, uv_transform=SKY.uv_transform.copy())  # as a new frame has: the picture itself is kept
    film = trace(with_world(scene, environment=sky, rotation=np.eye(3)), SETTINGS, cache=cache)
    assert found(film)["world"] == 1 and not made
    trace(with_world(scene, environment=replace(SKY, pixels=SKY.pixels.copy())), SETTINGS, cache=cache)
    assert made


def test_a_key_tells_what_differs():
    one, other = World((1, 1, 1), SKY), World((1, 1, 1), replace(SKY, tiles={}))
    assert key_of(one) == key_of(other) and hash(key_of(one)) == hash(key_of(other))
    for changed in (
        World((1, 1, 2), SKY),
        World((1, 1, 1), replace(SKY, extension="CLIP")),
        World((1, 1, 1), replace(SKY, pixels=SKY.pixels.copy())),
        World(Expression("image", (), SKY)),
        World((1, 1, 1), SKY, np.eye(3)[::-1]),
    ):
        assert key_of(changed) != key_of(one)
    assert key_of(World(Expression("image", (), SKY))) == key_of(World(Expression("image", (), SKY)))


def test_a_first_frame_finds_nothing(build):
    film = trace(start(build), SETTINGS, cache=SceneCache())
    assert not found(film) and not film.plan[2]["applies"]


def test_two_trees_find_what_one_finds(build, monkeypatch):
    """In general position; at equal distance the lower number wins."""
    scene = moved(start(build), 3, 0.0137)
    one = trace(scene, SETTINGS)
    monkeypatch.setattr(trees, "BUILD_SECONDS", 1.0)
    made = []
    real = trees.TwoTrees.__init__
    monkeypatch.setattr(trees.TwoTrees, "__init__", lambda self, *a: (made.append(1), real(self, *a))[1])
    same(trace(scene, SETTINGS), one)
    assert made


def test_at_equal_distance_the_lower_number_wins(build):
    quad = build.quad([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    scene = build.scene((quad, build.matte()), (quad, build.matte(), {"moves": True}))
    g = flatten(scene, [{}, {}])
    tree = trees.trees_over(g, np.ones(4, bool), SceneCache(0), divided=True)
    xy = np.random.default_rng(1).uniform(-0.9, 0.9, (2, 1000)).astype(np.float32)
    origin = np.concatenate([xy, np.ones((1, 1000), np.float32)])
    down = np.tile(np.array([[0], [0], [-1]], np.float32), (1, 1000))
    assert set(tree.intersect(origin, down)) == {0, 1}
    assert tree.occluded(origin, down, np.full(1000, 2, np.float32)).all()
    assert not tree.occluded(origin, down, np.full(1000, 0.5, np.float32)).any()


def test_the_trees_do_not_depend_on_earlier_frames(build):
    """Whether they are divided is told by the scene, the settings and the pixels alone."""
    g = flatten(start(build), [{}] * 9)
    assert trees.divides(g, 1, 1) and not trees.divides(g, 16, 10**6)
    assert not trees.divides(flatten(with_instance(start(build), 3, moves=False), [{}] * 9), 1, 1)


def test_what_is_kept_is_bounded_and_goes(build):
    cache, scene = SceneCache(limit=100), start(build)
    for _ in range(2):
        assert not found(trace(scene, SETTINGS, cache=cache))
    cache = SceneCache()
    for x in range(4):
        trace(moved(scene, 3, x), SETTINGS, cache=cache)
    shapes = [key for key in cache._things[1] if isinstance(key, tuple) and key[0] == "shape"]
    assert len(shapes) == len(scene.instances) and not cache._things[0]
    cache.forget()
    assert not found(trace(scene, SETTINGS, cache=cache))


def test_the_centre_follows_what_moves_in_steps_that_scale_with_the_scene(build):
    still, moving = start(build), with_instance(start(build), 1, moves=True)
    assert len(centers(still)) == 41 and 2 <= len(centers(moving)) <= 6
    for k in (-13, 23):
        big = [replace(i, matrix_world=np.diag([2.0**k] * 3 + [1]) @ i.matrix_world) for i in moving.instances]
        scaled = flatten(replace(moving, instances=tuple(big)), [{}] * 9)
        np.testing.assert_array_equal(scaled.vertices, flatten(moving, [{}] * 9).vertices * np.float32(2.0**k))
    floor = moving.instances[2]
    wide = with_instance(moving, 2, matrix_world=np.diag([1000.0, 1000, 1, 1]) @ floor.matrix_world)
    assert len(centers(wide)) == 41


def centers(scene):
    return {tuple(flatten(moved(scene, 1, x), [{}] * 9).center) for x in np.linspace(0, 4, 41)}


def test_fog_is_made_once_until_it_changes(build, monkeypatch):
    made, init = [], CompiledFog.__init__
    monkeypatch.setattr(CompiledFog, "__init__", lambda self, *a: (made.append(1), init(self, *a))[1])
    body = FogBody("haze", build.box(), np.eye(4), Medium(absorption=(0.1, 0.2, 0.3)))
    cache, scene = SceneCache(), replace(start(build), fog=Fog(bodies=(body,)))
    thicker = replace(scene, fog=Fog(bodies=(replace(body, medium=Medium(absorption=(1, 1, 1))),)))
    for frame, count in ((scene, 1), (CHANGES["another camera"](scene), 0), (thicker, 1)):
        fresh = trace(frame, SETTINGS)
        made.clear()
        same(trace(frame, SETTINGS, cache=cache), fresh)
        assert len(made) == count
