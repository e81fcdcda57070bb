# SPDX-License-Identifier: GPL-3.0-or-later
"""What tiles can read of a scene, and what they cannot do: such scenes are left to the waves."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from ...scene import Expression, Texture
from ...scene.texels import Texels, texels_of
from ..core.camera import is_wide
from ..core.vectors import Array
from ..emitters.light import CompiledLight
from ..geometry.aggregate import PrimitiveSet
from ..geometry.embree import OwnScene, TriangleScene
from ..prepare.compiled import CompiledScene

IN_FACTORS = "base_color", "emission", "transmission_tint"
"""Fields of surfaces that an image may give in a tile, in the order of `records.Skins.images`."""

MOST_DECODED = 1 << 22
"""Texels of an image that is made float32 for tiles, 64 MB: of those that are stored in other ways than they read."""

PLAIN, ROOT = 0, 1
"""What is made of an image."""


def why_not(scene: CompiledScene, seen: PrimitiveSet, aovs: list[str]) -> str:
    """The first thing of a scene, as rays see it that first see `seen`, that tiles cannot do; "" if they can do it."""
    return next(_obstacles(scene, seen, aovs), "")


def _obstacles(scene: CompiledScene, seen: PrimitiveSet, aovs: list[str]) -> Iterator[str]:
    g, table, plan = scene.geometry, scene.surfaces, scene.plan
    found = {
        "light passes": bool(aovs),
        "rough glass": bool((table.rough & table.refracts).any()),
        "the world's blurred image instead of rays": scene.settings.rough_samples == 0 and bool(table.rough.any()),
        "thin walls": scene.media.thin is not None,
        "solids that touch": scene.media.near is not None,
        "absorption": scene.media.absorption is not None or scene.media.shadow_absorption is not None,
        "a camera within a solid": scene.camera_in_solid,
        "lamps behind what casts no shadow": not all(map(_hides, [scene] * len(scene.lamps), scene.lamps)),
        "caustics of shadow rays": scene.settings.caustics == "SIMPLE" and scene.blockers_of_all.tints,
        "all rays wanted": plan.weightless or not plan.any_hit,
        "what the raster shows": scene.screen_space is not None,
        "fog": scene.fog is not None or bool(scene.fog_lights),
        "ambient occlusion": scene.occluders is not None,
        "lamps that are linked": scene.linked_lamps or any(_is_linked(light) for light in scene.lights),
        "surfaces that ask for rays": scene.asks_rays,
        "spheres and planes": g.sphere_count > 0 or g.flattened_count > g.triangle_count + g.sphere_count,
        "meshes kept once": g.instanced is not None,
        "a lens": scene.camera.lens is not None,
        "surface programs": bool(table.programmed.any()),
        "sums of closures": bool(table.closure_count.any()),
        "thin films": bool(table.filmed.any()),
        "translucent surfaces": bool(table.translucent.any()),
        "brushed surfaces": bool(table.brushed.any()),
        "insides of closed bodies": g.enclosed is not None and bool(table.admits.any()),
        "light from below surfaces": bool(table.scatters.any()),
        "layers that vary": bool((table.layered & ~table.tabulated.known).any()),
        "a very wide lens": is_wide(scene.camera),
        "a panorama": scene.camera.panorama is not None,
    }
    yield from (name for name, there in found.items() if there)
    sets = [seen, scene.seen_by_camera, scene.seen_by_secondary, scene.blockers_of_all.casts]
    if any(a is not None and trees_of(a) is None for a in sets):
        yield "faces that are left out"
    if not all(_is_known(light) for light in (*scene.lights, *scene.lamps)):
        yield "a kind of light"
    for surface in table.surfaces:
        varying = [f.name for f in fields(surface) if isinstance(getattr(surface, f.name), Expression)]
        if not all(name in IN_FACTORS and image_of(getattr(surface, name))[0] is not None for name in varying):
            yield "node expressions"
    for s in scene.world.skies:
        if not s.uniform and (not s.is_image or s.panorama.interpolation != "LINEAR" or not is_readable(s.panorama)):
            yield "a world of nodes"


def _hides(scene: CompiledScene, lamp: CompiledLight) -> bool:
    """Whether all that rays hit stands in the way of a lamp."""
    return lamp.light.cast_shadow and scene.casts_shadow(lamp) is None


def _is_known(light: CompiledLight) -> bool:
    """Whether tiles know this very kind of light: what a kind inherits tells of another one."""
    return "as_numbers" in vars(type(light)) and light.as_numbers() is not None


def _is_linked(light: CompiledLight) -> bool:
    return light.receives is not None or light.blocks is not None


def trees_of(seen: PrimitiveSet) -> tuple[TriangleScene, ...] | None:
    """The trees of a set, all of whose faces are there: one, or of what stands still and of what moves; None: it is
    another kind of set."""
    trees = seen.trees
    return trees if all(not tree.size or isinstance(tree.own, OwnScene) for tree in trees) and trees else None


def image_of(value: Any) -> tuple[Texture | None, int]:
    """The image that alone gives a value, if tiles can read it, and what is made of it: PLAIN, or the ROOT of what of
    it lies within 0 .. 1, as glass has it of its colour."""
    made = PLAIN
    if isinstance(value, Expression) and value.operation == "root":
        (value,), made = value.inputs, ROOT
        if not isinstance(value, Expression) or value.operation != "clamp" or value.inputs[1:] != (0.0, 1.0):
            return None, made
        value = value.inputs[0]
    if not isinstance(value, Expression) or value.operation != "image" or value.inputs:
        return None, made
    texture: Texture = value.data
    if texture.tiles or texture.interpolation != "LINEAR":
        return None, made
    return (texture if is_readable(texture) else None), made


def is_readable(texture: Texture) -> bool:
    """Whether tiles can read it, without a copy that is too large."""
    texels = texels_of(texture.pixels)
    return _is_as_read(texels) or texels.stored.shape[0] * texels.stored.shape[1] <= MOST_DECODED


def _is_as_read(texels: Texels) -> bool:
    """Whether it is stored as tiles read it: RGBA of float32, or of bytes with one curve."""
    if texels.stored.shape[2] != 4 or not texels.stored.flags.c_contiguous:
        return False
    return texels.is_plain or (texels.stored.dtype == np.uint8 and texels.only_curve is not None)


_decoded: WeakKeyDictionary[Texels, Array] = WeakKeyDictionary()


def stored_as(texture: Texture) -> tuple[Array, Array | None]:
    """Texels (h, w, 4) float32, or bytes and their curve (256,): as they are stored, or a copy made once."""
    texels = texels_of(texture.pixels)
    if _is_as_read(texels):
        return texels.stored, None if texels.is_plain else texels.only_curve
    if texels not in _decoded:
        _decoded[texels] = np.ascontiguousarray(texels.rgba())
    return _decoded[texels], None
