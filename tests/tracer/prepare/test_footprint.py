# SPDX-License-Identifier: GPL-3.0-or-later
"""Memory: what a scene is expected to take, what it has taken, and that it is refused before it is built."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon import memory
from hybrid_addon.scene import (
    Camera,
    Expression,
    Instance,
    Scene,
    Settings,
    Surface,
    Texels,
    Texture,
    TriangleMesh,
    World,
)
from hybrid_addon.tracer import SceneCache, trace
from hybrid_addon.tracer.prepare import compiled
from hybrid_addon.tracer.prepare.footprint import expected, of_textures

SETTINGS = Settings(samples=1)


@pytest.fixture
def scene():
    vertices = np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], np.float32)
    triangles = np.array([[0, 1, 2]], np.int32)
    place = np.eye(4)
    place[2, 3] = 4
    return Scene(
        Camera("PERSP", place, (-0.5, 0.5, -0.5, 0.5), (8, 8), (0, 0, 8, 8)),
        (TriangleMesh("leaf", vertices, triangles, triangles),),
        tuple(Instance(f"leaf {i}", 0, np.eye(4), (0,), ray_traced=True) for i in range(3)),
        surfaces=(Surface("green"),),
    )


def test_instances_count_each(scene):
    one = expected(replace(scene, instances=scene.instances[:1]), SETTINGS, 64)
    three = expected(scene, SETTINGS, 64)
    assert three["geometry"] == 3 * one["geometry"] > 0
    assert three["search trees"] == 3 * one["search trees"] > 0
    assert three["film"] == one["film"]
    clear = replace(scene, surfaces=(Surface("glass", opacity=0.0),))
    assert expected(clear, SETTINGS, 64)["geometry"] > three["geometry"]


def test_textures_are_named_by_size_and_shared_ones_count_once(scene):
    small, large = Texels(np.zeros((4, 4, 4), np.uint8)), Texels(np.zeros((8, 8, 1), np.float16))
    worn = [
        Expression("image", (), Texture(name, texels))
        for name, texels in (("small", small), ("large", large), ("again", small.multiplied()))
    ]
    surfaces = tuple(Surface("s", base_color=expression) for expression in worn)
    sky = Texture("sky", np.zeros((2, 4, 4), np.float32))
    found = of_textures(replace(scene, surfaces=surfaces, world=World((1, 1, 1), sky)))
    assert list(found.items()) == [("large", 128), ("sky", 128), ("small", 64)]


def test_a_film_says_what_was_taken(scene):
    texture = Expression("image", (), Texture("bark", Texels(np.zeros((4, 4, 4), np.uint8))))
    found = trace(replace(scene, surfaces=(Surface("s", base_color=texture),)), SETTINGS).memory
    assert found["by_texture"] == {"bark": 64}
    assert found["textures"] == 64
    assert found["meshes"] == sum(a.nbytes for a in (scene.meshes[0].vertices, scene.meshes[0].triangles)) + 12
    assert found["geometry"] > 0
    assert found["film"] == 8 * 8 * 4 * 5  # radiance, coverage, residual
    assert found["peak"] == memory.peak()


def test_what_does_not_fit_is_refused_before_it_is_built(scene, monkeypatch):
    monkeypatch.setattr(memory, "available", lambda: 4000)
    monkeypatch.setattr(compiled, "prepare", lambda *_: pytest.fail("it was built"))
    with pytest.raises(memory.NotEnoughMemory, match=r"0.0 million triangles \(100% of mesh 'leaf'\)"):
        trace(scene, SETTINGS)
    monkeypatch.undo()
    monkeypatch.setattr(memory, "available", lambda: 4000)
    trace(scene, SETTINGS, np.zeros((8, 8), np.float32))  # nothing to trace, nothing to refuse


def test_what_is_kept_makes_room_for_what_is_asked(scene, monkeypatch):
    cache = SceneCache()
    trace(scene, SETTINGS, cache=cache)
    assert any(cache._things)
    monkeypatch.setattr(memory, "available", lambda: 1000 if any(cache._things) else 1 << 40)
    trace(scene, SETTINGS, cache=cache)


def test_a_machine_that_cannot_tell_refuses_nothing(scene, monkeypatch):
    monkeypatch.setattr(memory, "available", lambda: None)
    trace(scene, SETTINGS)
