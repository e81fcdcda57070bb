# SPDX-License-Identifier: GPL-3.0-or-later
"""Tiles draw the picture of the waves, to the last bit; what they cannot do, waves do."""

from __future__ import annotations

import math
import threading
import time
from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon import accelerated
from hybrid_addon.scene import (
    AreaLight,
    Arriving,
    Expression,
    PointLight,
    Settings,
    SpotLight,
    SunLight,
    Surface,
    Texture,
    World,
)  # fmt: skip
from hybrid_addon.tracer import Cancelled, trace
from hybrid_addon.tracer.integrator import tiles
from hybrid_addon.tracer.integrator.tile_obstacles import why_not
from hybrid_addon.tracer.kernels.tiles import apart
from hybrid_addon.tracer.prepare.compiled import CompiledScene

pytestmark = pytest.mark.once

HOW = Settings(
    samples=4, camera_sees="ALL", threads=1, adaptive=0.05, cutoff=1 / 255, processes=False, shadow_samples=1,
    rough_samples=1,
)  # fmt: skip
HERE = {"position": (3, 2, 6), "range": 40.0}
LAMPS = {
    "disk of a point": PointLight("lamp", intensity=(400, 400, 300), radius=0.5, soft_falloff=True, **HERE),
    "ball": PointLight("lamp", intensity=(400, 400, 300), radius=0.5, soft_falloff=False, **HERE),
    "point": PointLight("lamp", intensity=(400, 400, 300), **HERE),
    "spot": SpotLight(
        "lamp", intensity=(400, 400, 300), radius=0.3, world_to_light=((1, 0, 0), (0, 1, 0), (0, 0, 1)), cos_cone=0.7,
        blend=0.3, **HERE,
    ),
    "sun": SunLight("lamp", (0.3, 0.2, 1), (2, 2, 1), angle=0.1),
    "sharp sun": SunLight("lamp", (0.3, 0.2, 1), (2, 2, 1)),
    "rectangle": AreaLight(
        "lamp", direction=(0, 0, -1), axis_u=(1, 0, 0), axis_v=(0, 0.6, 0), radiance=(40, 40, 30), **HERE
    ),
    "ellipse": AreaLight(
        "lamp", direction=(0, 0, -1), axis_u=(1, 0, 0), axis_v=(0, 0.6, 0), radiance=(40, 40, 30), shape="ELLIPSE",
        **HERE,
    ),
}  # fmt: skip


def image(seed: int, **other) -> Expression:
    pixels = np.random.default_rng(seed).random((5, 7, 4)).astype(np.float32)
    return Expression("image", (), Texture("image", pixels, **other))


def rooms(build) -> dict[str, tuple]:
    """Scenes and settings by name, with something of all that tiles know."""
    floor = build.quad([(-9, -9, -1), (9, -9, -1), (9, 9, -1), (-9, 9, -1)])
    camera = build.camera((0, -6, 3), up=(0, 0, 1), size=(24, 18))
    ball, cube = build.icosphere(2, smooth=True), build.box((1.2, -1, -1), (2, 0, 1))
    tinted = build.glass(transmission_tint=(0.9, 0.5, 0.4))
    layers = Surface(base_color=(0.8, 0.3, 0.2), layered=True, roughness=0.5, specular=(0.04,) * 3)
    shiny = build.matte(specular=(0.3, 0.3, 0.3))
    coated = replace(layers, coat=1.0, coat_roughness=0.1, roughness=0.6)

    def room(*lights, **other):
        values = {"camera": camera, "world": World((0.4, 0.5, 0.8)), "lights": lights} | other
        parts = values.pop("parts", [(ball, tinted), (cube, build.mirror(0.6)), (floor, layers)])
        return build.scene(*parts, **values)

    found = {name: (room(lamp), HOW) for name, lamp in LAMPS.items()}
    lamp, sun = LAMPS["disk of a point"], LAMPS["sun"]
    texels = np.random.default_rng(1).random((8, 16, 4)).astype(np.float32)
    around = World((1, 0.9, 0.8), environment=Texture("sky", texels * 3))
    rooted = Expression("root", (Expression("clamp", (image(2), 0.0, 1.0)),))
    flat, fine = build.icosphere(1), build.icosphere(4, radius=0.7, smooth=True)
    metal = build.mirror(0.8, roughness=0.3, layered=True)
    lacquer = replace(metal, coat=1.0, coat_roughness=0.15)
    shiny_coat = replace(coated, coat_roughness=0.02)
    traced, rough = replace(layers, roughness=0.2), replace(HOW, rough_samples=3)
    inner = build.icosphere(1, radius=0.6, smooth=True)
    found |= {
        "environment": (room(lamp, world=around), HOW),
        "orthographic": (room(lamp, camera=replace(camera, projection="ORTHO")), HOW),
        "flat": (room(lamp, parts=[(flat, build.glass()), (floor, build.matte())]), HOW),
        "nested": (room(lamp, sun, parts=[(ball, build.glass()), (inner, build.glass(1.2)), (floor, layers)]), HOW),
        "straight on": (room(lamp, parts=[(ball, replace(tinted, ior=1.0)), (floor, layers)]), HOW),
        "transparent": (room(lamp, parts=[(ball, tinted)]), replace(HOW, transparent=True)),
        "limits": (room(lamp, arriving=Arriving(0.5, 2.0, 1.0)), HOW),
        "no cutoff": (room(lamp, sun), replace(HOW, cutoff=0.0, max_depth=3, shadow_samples=2)),
        "crowded": (room(lamp, parts=[(ball, tinted), (flat, tinted), (inner, tinted), (cube, tinted)]), HOW),
        "emission": (room(parts=[(ball, build.emitter(3, 2, 1)), (floor, build.mirror(0.5))]), HOW),
        "Phong": (room(lamp, sun, parts=[(ball, replace(shiny, roughness=0.3)), (floor, build.matte())]), HOW),
        "coat": (room(lamp, parts=[(ball, replace(coated, coat_roughness=0.5)), (floor, layers)], world=around), HOW),
        "textures": (
            room(lamp, parts=[
                (ball, build.matte(image(1))), (cube, build.glass(transmission_tint=rooted)),
                (floor, replace(layers, base_color=image(3, extension="CLIP"))),
            ]),
            HOW,
        ),
        "rough": (room(lamp, parts=[(ball, metal), (cube, replace(metal, roughness=0.6)), (floor, shiny_coat)]), rough),
        "rough and flat": (room(sun, parts=[(flat, metal), (floor, build.glass()), (cube, build.mirror())]), HOW),
        "rough coats": (
            room(lamp, parts=[(ball, lacquer), (cube, replace(lacquer, coat_roughness=0.02)), (floor, traced)]), rough,
        ),
        "rough and no cutoff": (room(lamp, parts=[(ball, lacquer), (floor, metal)]), replace(rough, cutoff=0.0)),
        "moving": (room(lamp, parts=[(ball, tinted, {"moves": True}), (fine, metal), (floor, layers)]), HOW),
        "black": (room(world=World((0, 0, 0)), parts=[(ball, build.mirror())]), HOW),
        "only what is ray traced": (
            room(lamp, parts=[(ball, tinted), (floor, layers, {"ray_traced": False})], world=around),
            replace(HOW, camera_sees="RAY_TRACED"),
        ),
    }  # fmt: skip
    return found


NAMES = (
    *LAMPS, "environment", "orthographic", "flat", "nested", "straight on", "transparent", "limits", "no cutoff",
    "crowded", "emission", "Phong", "coat", "textures", "rough", "rough and flat", "rough coats",
    "rough and no cutoff", "moving", "black", "only what is ray traced",
)  # fmt: skip


@pytest.fixture(scope="module")
def all_rooms(build):
    found = rooms(build)
    assert set(found) == set(NAMES)
    return found


@pytest.fixture
def twins(kernels, monkeypatch):
    """The function that tiles are, with all kernels in use but its own."""
    monkeypatch.setenv(kernels.SWITCH, "1")
    kernels.load({tiles.NAME})
    found = accelerated.ALL[tiles.NAME]
    assert found.compiled is not None, accelerated.failed()
    found.kernel = None
    yield found
    found.kernel = None


def same(film, other) -> None:
    for name in ("radiance", "coverage", "residual"):
        np.testing.assert_array_equal(getattr(film, name), getattr(other, name))
    assert (film.rays, film.invariants, film.ended) == (other.rays, other.invariants, other.ended)
    assert sorted(map(str, film.skipped)) == sorted(map(str, other.skipped))


@pytest.mark.parametrize("name", NAMES)
def test_tiles_change_no_bit_of_a_picture(twins, all_rooms, name: str) -> None:
    scene, how = all_rooms[name]
    compiled = CompiledScene(scene, how)
    assert why_not(compiled, compiled.seen_by_camera, []) == ""
    assert (len(compiled.seen_by_camera.trees) == 2) == (name == "moving")
    wanted = trace(scene, how)
    calls = []
    twins.kernel = lambda *args: calls.append(1) or twins.compiled(*args)
    same(trace(scene, how), wanted)
    same(trace(scene, replace(how, threads=3)), wanted)
    assert calls and not accelerated.failed()


def test_what_tiles_cannot_do_is_drawn_in_waves(twins, build) -> None:
    rough = build.scene((build.box(), build.glass(roughness=0.3, layered=True)), camera=build.camera((0, -6, 3)))
    compiled = CompiledScene(rough, HOW)
    assert why_not(compiled, compiled.seen_by_camera, []) == "rough glass"
    assert why_not(compiled, compiled.seen_by_camera, ["reflection"]) == "light passes"
    wanted = trace(rough, HOW)
    twins.kernel = lambda *args: pytest.fail("asked")
    same(trace(rough, HOW), wanted)


def test_waves_draw_what_a_failing_kernel_has_begun(twins, all_rooms, monkeypatch) -> None:
    scene, how = all_rooms["ball"]
    wanted = trace(scene, how)
    monkeypatch.setattr(tiles, "AT_ONCE", 64)
    calls = []

    def fails_later(*args):
        calls.append(1)
        return twins.compiled(*args) and len(calls) < 3

    twins.kernel = fails_later
    same(trace(scene, how), wanted)
    assert len(calls) >= 3


def test_one_may_stop_between_tiles(twins, all_rooms, monkeypatch) -> None:
    scene, how = all_rooms["ball"]
    monkeypatch.setattr(tiles, "AT_ONCE", 64)
    calls, stop = [], threading.Event()

    def slow(*args):
        calls.append(1)
        stop.wait(0.02)
        return twins.compiled(*args)

    twins.kernel = slow
    with pytest.raises(Cancelled):
        trace(scene, replace(how, samples=64), progress=lambda done: not calls)
    asked = len(calls)
    assert 0 < asked < 64 * 24 * 18 // 64
    film = trace(scene, replace(how, samples=64), deadline=time.perf_counter() - 1)
    assert len(calls) < asked + 200 and math.isfinite(film.radiance.max())


def test_another_process_compiles_what_takes_long(loaded, monkeypatch, tmp_path) -> None:
    name = "tracer.core.vectors.largest_component"
    monkeypatch.setattr(loaded, "_folder", [tmp_path])
    assert not loaded.is_kept(name)
    assert apart.compile_apart(name) and loaded.is_kept(name)
    monkeypatch.setattr(loaded, "_folder", [tmp_path / "other"])
    monkeypatch.setattr(loaded, "_stop", threading.Event())
    loaded._stop.set()
    assert not apart.compile_apart(name) and not loaded.is_kept(name)  # ended with this process


def test_what_is_kept_is_loaded_at_once_and_compiled_later(loaded, monkeypatch) -> None:
    done, kept, now = [], [], [0.0]
    monkeypatch.setenv(loaded.SWITCH, "1")
    monkeypatch.setattr(apart, "_since", {})
    monkeypatch.setattr(apart, "_asked", set())
    monkeypatch.setattr(apart.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(apart.threading, "Thread", _AtOnce)
    monkeypatch.setattr(loaded, "is_kept", lambda name: bool(kept))
    monkeypatch.setattr(loaded, "load", done.append)
    monkeypatch.setattr(apart, "compile_apart", lambda name: kept.append(name) or True)
    apart.ask_for("kernel")
    now[0] = apart.PATIENCE / 2
    apart.ask_for("kernel")
    assert not done and not kept
    now[0] = apart.PATIENCE
    apart.ask_for("kernel")
    apart.ask_for("kernel")
    assert done == [{"kernel"}] and kept == ["kernel"]
    apart.ask_for("other")  # which is there
    assert done == [{"kernel"}, {"other"}] and kept == ["kernel"]


class _AtOnce:
    """A thread that has run when it is started."""

    def __init__(self, target, args, **_other) -> None:
        self.start = lambda: target(*args)
