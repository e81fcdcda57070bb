# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes prepared worse than need be, with what a plan leaves out: so that it shows that this changes no bit."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from unittest import mock

import numpy as np

from hybrid_addon.expressions import expressions_of
from hybrid_addon.scene import Expression, Float32, Lens, Scene, Settings, Texture
from hybrid_addon.tracer import CompiledScene, SceneCache, render
from hybrid_addon.tracer.emitters.light import CompiledLight
from hybrid_addon.tracer.prepare import compiled, plan
from hybrid_addon.tracer.prepare.tables import Prepared, prepare

Change = Callable[[Prepared, Settings], Prepared]


@contextmanager
def without(*names: str) -> Iterator[None]:
    """Within it scenes are prepared without these prunings. Raises ValueError for a name that is none."""
    unknown = sorted({*names} - {*NAMES})
    if unknown:
        raise ValueError(f"no pruning is called {unknown[0]!r}")

    def worse(scene: Scene, settings: Settings, cache: SceneCache | None = None) -> Prepared:
        for name in names:
            scene = SCENES[name](scene) if name in SCENES else scene
        prepared = prepare(scene, settings, cache)
        for name in names:
            prepared = CHANGES[name](prepared, settings) if name in CHANGES else prepared
        return prepared

    with ExitStack() as stack:
        stack.enter_context(mock.patch.object(compiled, "prepare", worse))
        for name in names:
            for where, what, instead in PATCHES.get(name, ()):
                stack.enter_context(mock.patch.object(where, what, instead))
        yield


# ------------------------------------------------------------------------------------------------ flags and tables


def flags(**values: bool) -> Change:
    """Stages of the wave loop that run although they need not, or the other way round."""
    return lambda p, _: replace(p, plan=replace(p.plan, **values))  # type: ignore[arg-type]


def _rough(p: Prepared, settings: Settings) -> Prepared:
    return flags(rough=p.plan.secondary and settings.rough_samples > 0)(p, settings)


def _occlusion(p: Prepared, settings: Settings) -> Prepared:
    return flags(occlusion=settings.occlusion_samples > 0)(p, settings)


def _soft_shadows(p: Prepared, settings: Settings) -> Prepared:
    return flags(soft_shadows=p.plan.shadows and settings.shadow_samples > 0)(p, settings)


def _screen_space(p: Prepared, _: Settings) -> Prepared:
    return flags(screen_space=p.plan.secondary)(p, _)  # only for a scene with a raster


def _raster_shadows(p: Prepared, settings: Settings) -> Prepared:
    return flags(raster_shadows=p.plan.shadows and settings.raster_shadows)(p, settings)


def _media(p: Prepared, _: Settings) -> Prepared:
    """A stack of media around each ray, empty."""
    if p.media.rows:
        return p
    return replace(p, media=replace(p.media, rank=np.zeros(len(p.geometry.surface), np.int32), rows=1))


def _absorption(p: Prepared, _: Settings) -> Prepared:
    """Media that absorb nothing."""
    if p.media.absorption is not None:
        return p
    rank = p.media.rank if len(p.media.rank) else np.zeros(len(p.geometry.surface), np.int32)
    nothing = np.zeros((3, p.media.count + 1))
    return replace(p, media=replace(p.media, rank=rank, absorption=nothing, shadow_absorption=nothing))


def _normals(p: Prepared, _: Settings) -> Prepared:
    """Shading normals that are none."""
    if p.geometry.normals is not None:
        return p
    return replace(p, geometry=replace(p.geometry, normals=np.zeros((p.geometry.triangle_count, 9), np.float32)))


def _linked(p: Prepared, _: Settings) -> Prepared:
    """Lights that are linked to everything."""
    if any(light.receives is not None or light.blocks is not None for light in (*p.lights, *p.lamps)):
        return p
    every = np.ones(len(p.geometry.object), bool)

    def all_of(lights: list[CompiledLight]) -> list[CompiledLight]:
        return [replace(light, receives=every, blocks=every) for light in lights]

    return replace(p, lights=all_of(p.lights), lamps=all_of(p.lamps))


def _lens(p: Prepared, _: Settings) -> Prepared:
    """A pinhole that is a lens of no size."""
    return p if p.camera.lens is not None else replace(p, camera=replace(p.camera, lens=Lens(0.0, 1.0)))


CHANGES: dict[str, Change] = {
    "reflection": flags(reflection=True, secondary=True),
    "refraction": flags(refraction=True, secondary=True),
    "secondary": flags(secondary=True),
    "weightless": lambda p, s: flags(weightless=p.plan.secondary)(p, s),
    "roughness": _rough,
    "depth-of-field": _lens,
    "emission": flags(emission=True),
    "ambient": flags(ambient=True),
    "occlusion": _occlusion,
    "diffuse": flags(diffuse=True),
    "highlights": flags(specular=True),
    "light-linking": _linked,
    "shadows": lambda p, s: flags(shadows=p.plan.diffuse or p.plan.specular)(p, s),
    "unlit": flags(unlit=True),
    "soft-shadows": _soft_shadows,
    "any-hit": flags(any_hit=False),
    "normals": _normals,
    "world": flags(world=True),
    "media": _media,
    "absorption": _absorption,
    "raster-shadows": _raster_shadows,
    "screen-space": _screen_space,
    "faint-light": flags(faint=False),
}

# ------------------------------------------------------------------------------------------------ scenes and lights


def _image(color: Sequence[float]) -> Texture:
    pixels = np.broadcast_to(np.array([*color, 1], np.float32), (4, 8, 4))
    return Texture("constant", pixels, interpolation="CLOSEST")


def _with_textures(scene: Scene) -> Scene:
    """Images of one colour for colours. Not where surfaces answer in layers: with constants these are tabulated."""
    if any(expressions_of(s) for s in scene.surfaces):
        return scene
    surfaces = [
        s if s.layered else replace(s, base_color=Expression("image", (), _image(s.base_color)))  # type: ignore[arg-type]
        for s in scene.surfaces
    ]
    return replace(scene, surfaces=tuple(surfaces))


def _with_environment(scene: Scene) -> Scene:
    """An image for a uniform world; not where surfaces answer in layers: they would show it blurred."""
    world = scene.world
    uniform = world.environment is None and not isinstance(world.radiance, Expression)
    if not uniform or any(s.layered for s in scene.surfaces):
        return scene
    return replace(scene, world=replace(world, environment=_image((1, 1, 1)), sun=None))


def _all_of(lights: Sequence[CompiledLight], *_: object) -> list[CompiledLight]:
    return list(lights)


def _with_everything(scene: Scene, settings: Settings, mask: Float32 | None, cache: SceneCache | None) -> CompiledScene:
    return CompiledScene(scene, settings, cache)


SCENES: dict[str, Callable[[Scene], Scene]] = {"textures": _with_textures, "environment": _with_environment}
PATCHES: dict[str, list[tuple[object, str, object]]] = {
    "black-lights": [(plan, "_useful_lights", _all_of)],
    "far-lights": [(plan, "can_reach", lambda *_: True)],
    "lamps": [(plan, "_lamps", _all_of)],
    "empty-mask": [(render, "_compiled", _with_everything)],
}
NAMES = (*CHANGES, *SCENES, *PATCHES)
EXACT = tuple(name for name in NAMES if name not in ("faint-light", "empty-mask"))
"""Those that change no bit; an empty mask has a test of its own."""
