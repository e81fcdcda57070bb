# SPDX-License-Identifier: GPL-3.0-or-later
"""Random scenes: however the work is dealt out, and whatever is left out, the picture is the same, bit for bit.

Everything meets everything here: smooth, flat, mirrored and overlapping bodies of all surfaces, lights of all kinds,
linked ones among them, objects that some rays do not see. `HYBRID_RANDOM_SCENES=1000` tries so many of each.
"""

import os
from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import (
    AreaLight,
    Lens,
    Plane,
    PointLight,
    Settings,
    Sphere,
    SpotLight,
    SunLight,
    Surface,
    Visibility,
    World,
)
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.sampling import strips, tiles
from tests.tracer.unpruned import EXACT, without

SCENES = int(os.environ.get("HYBRID_RANDOM_SCENES", "24"))
CHOSEN = sorted({*EXACT} - {"weightless"})  # without it rays double at each bounce
PASSES = frozenset({"depth", "normal", "samples", "reflection", "refraction"})


class Draw:
    """Random numbers, and what is made of them."""

    def __init__(self, seed, build):
        self.rng, self.build = np.random.default_rng(seed), build

    def one_of(self, *options):
        return options[self.rng.integers(len(options))]

    def happens(self, probability):
        return bool(self.rng.random() < probability)

    def place(self, reach):
        return tuple(self.rng.uniform(-reach, reach, 3).tolist())

    def direction(self):
        d = self.rng.normal(size=3)
        return tuple((d / np.linalg.norm(d)).tolist())

    def matrix(self):
        m = np.eye(4)
        m[:3, :3] = np.linalg.qr(self.rng.normal(size=(3, 3)))[0] * self.one_of(1, 1, 2, -1)
        m[:3, 3] = self.place(2)
        return m

    def visibility(self):
        return Visibility(*(self.happens(0.9) for _ in range(3)))

    def surface(self):
        build, color, ior = self.build, tuple(self.rng.random(3).tolist()), self.one_of(1.0, 1.33, 1.5, 0.7)
        return self.one_of(
            build.matte(color),
            build.matte(color, specular=(0.4, 0.4, 0.4)),
            build.mirror(self.one_of(1, 0.4)),
            build.glass(ior),
            build.glass(1.4, absorption=(0.5, 1, 2), transmission_tint=(0.9, 0.8, 1)),
            build.emitter(1, 2, 3),
            Surface(opacity=0.5, ior=ior, base_color=color),
            Surface(layered=True, base_color=color, specular=(0.04,) * 3, roughness=0.1, coat=1.0, sheen=0.5),
            Surface(layered=True, opacity=0.0, specular=(0.04,) * 3, roughness=0.3, thin=self.happens(0.3)),
        )

    def light(self, number):
        linked = {
            "receivers": frozenset({0, 1}) if self.happens(0.2) else None,
            "blockers": frozenset({0}) if self.happens(0.2) else None,
            "cast_shadow": self.happens(0.9),
        }
        name, place, soft, size = f"light {number}", self.place(6), self.happens(0.5), self.one_of(0.0, 0.5)
        world_to_light = np.linalg.qr(self.rng.normal(size=(3, 3)))[0]
        u, v = (tuple((self.rng.normal(size=3) / 2).tolist()) for _ in range(2))
        return self.one_of(
            PointLight(name, place, (20, 20, 20), size, range=self.one_of(np.inf, 6.0), soft_falloff=soft, **linked),
            SpotLight(name, place, (20, 20, 20), size, cos_cone=0.2, world_to_light=world_to_light, **linked),
            SunLight(name, self.direction(), (2, 2, 2), self.one_of(0.0, 0.3), **linked),
            AreaLight(name, place, self.direction(), u, v, (9, 9, 9), self.one_of("RECTANGLE", "ELLIPSE"), **linked),
        )

    def world(self):
        return World((0.2, 0.3, 0.4)) if self.happens(0.7) else World()

    def camera(self):
        kind, lens = self.one_of("PERSP", "PERSP", "ORTHO"), Lens(0.2, 5.0) if self.happens(0.2) else None
        eye = tuple(self.rng.uniform(1, 5, 3).tolist())
        camera = self.build.camera(eye, (0, 0, 0), (0, 0, 1), (16, 12), projection=kind, lens=lens)
        return camera if kind == "PERSP" else replace(camera, view_plane=(-3, 3, -2.25, 2.25))

    def scene(self):
        """Up to six bodies among all that there is."""
        build, quad = self.build, self.build.quad([(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)])
        shapes = build.icosphere(1, 0.8, smooth=True), build.icosphere(1, 0.7), build.box(), quad
        parts = [
            (
                self.one_of(*shapes),
                self.surface(),
                {"matrix": self.matrix(), "visibility": self.visibility(), "ray_traced": self.happens(0.7)},
            )
            for _ in range(self.rng.integers(2, 7))
        ]
        lights = tuple(self.light(number) for number in range(self.rng.integers(0, 4)))
        scene = build.scene(*parts, camera=self.camera(), lights=lights, world=self.world())
        if self.happens(0.3):
            ball = Sphere("ball", self.place(2), 0.6, 0, self.happens(0.5))
            scene = replace(scene, spheres=(ball,))
        if self.happens(0.2):
            scene = replace(scene, planes=(Plane("plane", (0, 0, -2), (0, 0, 1), 0, self.happens(0.5)),))
        return scene

    def settings(self, **other):
        return Settings(
            samples=self.one_of(1, 3), max_depth=self.one_of(0, 1, 3, 6), threads=1, rough_samples=self.one_of(0, 2),
            occlusion_samples=self.one_of(0, 2), occlusion_distance=self.one_of(0.7, np.inf),
            cutoff=self.one_of(0.0, 1 / 255, 1 / 16), **other,
        )  # fmt: skip


@pytest.fixture
def draw(request, build, monkeypatch):
    monkeypatch.setattr(tiles, "WORTH_IT", 0)
    monkeypatch.setattr(tiles, "SHORTEST", 0)
    monkeypatch.setattr(tiles, "SMALLEST_TILE", 64)
    return Draw(request.param, build)


every_scene = pytest.mark.parametrize("draw", range(SCENES), indirect=True)


def same(a, b):
    for name in ("radiance", "coverage", "residual", "shadow", "caustic"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=name)
    for name in a.passes:
        np.testing.assert_array_equal(a.passes[name], b.passes[name], err_msg=name)


@every_scene
def test_how_work_is_dealt_out_changes_no_bit(draw, monkeypatch):
    scene, camera_sees = draw.scene(), draw.one_of("ALL", "RAY_TRACED")
    how = draw.settings(camera_sees=camera_sees, transparent=draw.happens(0.3), passes=draw.one_of(frozenset(), PASSES))
    mask = None
    if camera_sees == "RAY_TRACED":
        mask = trace(scene, how).coverage if draw.happens(0.6) else None
        how = replace(
            how, raster_shadows=draw.happens(0.4), caustics=draw.one_of("NONE", "SIMPLE", "PHOTONS"), photons=2000
        )
    film = trace(scene, how, mask)
    assert not {name: n for name, n in film.invariants.items() if n and name not in ("lost_media", "negative_radiance")}
    same(trace(scene, replace(how, chunk=7), mask), film)
    same(trace(scene, replace(how, threads=3, chunk=40), mask), film)
    same(trace(scene, replace(how, threads=2, processes=True), mask), film)
    monkeypatch.setattr(strips, "LONGEST_STRIP", 40)
    same(trace(scene, how, mask), film)


@every_scene
def test_what_is_left_out_changes_no_bit(draw):
    scene, how = draw.scene(), draw.settings(camera_sees=draw.one_of("ALL", "RAY_TRACED"))
    film = trace(scene, how)
    for name in draw.rng.choice(CHOSEN, 3, replace=False).tolist():
        with without(name):
            same(trace(scene, how), film)
