# SPDX-License-Identifier: GPL-3.0-or-later
"""Broken images: texels that are not finite count as black, as in Cycles.

One of them would else be all of the light of a sky.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any, TypeVar

import numpy as np

from ...expressions import expressions_of, walk
from ...scene import Closure, Expression, Scene, Surface, Texels, Texture, World
from ..core.cache import SceneCache, key_of

Images = Mapping[int, Texture]
T = TypeVar("T", Surface, World)


def with_finite_texels(scene: Scene, cache: SceneCache) -> tuple[Scene, int]:
    """The scene with black for numbers of its images that are not finite; and how many texels have such.

    kept : what an earlier frame has found, and what this one finds.
    """
    images = {id(e.data): e.data for s in scene.surfaces for e in expressions_of(s) if isinstance(e.data, Texture)}
    images |= {id(image): image for image in images_of(scene.world)}
    broken = {key: image for key, image in images.items() if not _finite(image, cache)}
    if not broken:
        return scene, 0
    parts = [part for image in broken.values() for part in image.parts]
    count = sum(int(np.count_nonzero(~np.isfinite(rows).all(axis=-1))) for part in parts for rows in part.bands())
    mended = {key: _mended(image) for key, image in broken.items()}
    surfaces = tuple(_mended_in(s, mended) for s in scene.surfaces)
    return replace(scene, world=_world(scene.world, mended), surfaces=surfaces), count


def images_of(world: World) -> list[Texture]:
    """All that a world and its backdrop are made of."""
    found = [world.environment, *(e.data for e in walk(world.radiance))]
    return [image for image in found if isinstance(image, Texture)] + (
        images_of(world.backdrop) if world.backdrop else []
    )


def _world(world: World, mended: Images) -> World:
    backdrop = _world(world.backdrop, mended) if world.backdrop else None
    return replace(_mended_in(world, mended), backdrop=backdrop)


def _finite(image: Texture, cache: SceneCache) -> bool:
    return cache.take(("finite", key_of(image.parts)), lambda: all(map(_is_finite, image.parts)))


def _is_finite(texels: Texels) -> bool:
    """A sum is finite only if all is; where it overflows all is looked at. Whole numbers are finite."""
    if texels.stored.dtype.kind == "u":
        return True
    with np.errstate(over="ignore", invalid="ignore"):
        return all(bool(np.isfinite(rows.sum()) or np.isfinite(rows).all()) for rows in texels.bands())


def _mended(image: Texture) -> Texture:
    """As float32: the few images that are broken."""
    pixels, *tiles = (texels if _is_finite(texels) else _black(texels) for texels in image.parts)
    return replace(image, pixels=pixels, tiles=dict(zip(image.tiles, tiles, strict=True)))


def _black(texels: Texels) -> Texels:
    return Texels(np.concatenate([np.where(np.isfinite(rows), rows, np.float32(0)) for rows in texels.bands()]))


def _mended_in(owner: T, mended: Images) -> T:
    """A surface or world over the mended images; what its expressions share they share still."""
    known: dict[int, Expression] = {}

    def mend(value: Any) -> Any:
        if isinstance(value, Texture):
            return mended.get(id(value), value)
        if isinstance(value, tuple) and any(isinstance(part, Closure) for part in value):
            return tuple(Closure(mend(part.weight), mend_all(part.surface)) for part in value)
        if not isinstance(value, Expression):
            return value
        if id(value) not in known:
            inputs = tuple(mend(given) for given in value.inputs)
            known[id(value)] = Expression(value.operation, inputs, mend(value.data))
        return known[id(value)]

    def mend_all(owner: Any) -> Any:
        return replace(owner, **{field.name: mend(getattr(owner, field.name)) for field in fields(owner)})

    mended_owner: T = mend_all(owner)
    return mended_owner
