# SPDX-License-Identifier: GPL-3.0-or-later
"""How much memory a scene takes: what is to be expected before it is built, and what it has taken."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ... import memory
from ...expressions import expressions_of
from ...scene import Scene, Settings, Surface, Texture
from ..core.cache import SceneCache
from ..geometry.embree import has_kernels
from ..geometry.flatten import Geometry
from ..geometry.instanced import saved_by_instancing
from ..geometry.parts import closed_wear
from .texels import images_of

GEOMETRY_BYTES = 450
"""Of a triangle: vertices, facets, barycentrics, normals, and what is needed while they are made.

Measured as growth of the process, with `TREE_BYTES`: 420 to 450 flat, 570 to 600 smooth, 690 with a UV map."""
MEDIA_BYTES = 200
"""More of a triangle where any surface transmits: to find the solids. Measured: 805 in all."""
TREE_BYTES = 150
"""Of a triangle, Embree's tree and its copy of the vertices."""
FILM_BYTES = 30
"""Of a pixel of the picture."""
LOOKED_AT = 1 << 20, 60
"""Pixels at most of a picture that is shown while it grows, and bytes of each while it is made (film/so_far.py)."""
SAMPLE_BYTES = 240
"""Of a pixel that is traced, what its samples add up to, in the strip that is traced."""
LONGEST_STRIP = 1 << 21
"""Pixels to be traced in a strip at most, but for a row's own: 500 MB. All of full HD is one strip."""
DENOISED_BYTES = 430, 490
"""More where light is denoised: of a pixel of a strip (12 numbers for each of 9 pixels around), and of the picture: 96
of light passes, and while it is denoised 390 more (measured with 1.2 million pixels, all of them rough)."""
DENOISED_STRIP = LONGEST_STRIP // 3
"""Strips are as much shorter then, so that they take as much as others."""
RAY_BYTES = 1400
"""Of a camera ray and all that becomes of it: 80 MB for what a thread begins at once."""

ADVICE = "lower subdivision levels or the number of instances, hide what no ray needs to meet, or lower the resolution"


def expected(scene: Scene, settings: Settings, pixels: int) -> dict[str, int]:
    """Bytes that a trace of this scene will take beside its meshes and textures, by what for.

    pixels : to be traced.
    """
    triangles = triangles_by_mesh(scene).total()
    transmits = any(_is_below_one(part.opacity) for s in scene.surfaces for part in s.parts)
    x0, y0, x1, y1 = scene.camera.window
    threads = settings.threads or os.cpu_count() or 1
    shown = min(pixels, LOOKED_AT[0]) * LOOKED_AT[1]
    rays = min(threads * settings.chunk, pixels * settings.samples)
    of_strip, of_film = DENOISED_BYTES if settings.denoise else (0, 0)
    strip = min(pixels, longest_strip(settings)) * (SAMPLE_BYTES + of_strip)
    return {
        "geometry": triangles * (GEOMETRY_BYTES + MEDIA_BYTES * transmits),
        "search trees": triangles * TREE_BYTES,
        "film": (x1 - x0) * (y1 - y0) * (FILM_BYTES + of_film) + strip + shown,
        "rays": rays * RAY_BYTES,
    }


def longest_strip(settings: Settings) -> int:
    """Pixels to be traced in a strip at most."""
    return DENOISED_STRIP if settings.denoise else LONGEST_STRIP


def require_memory(scene: Scene, settings: Settings, pixels: int, cache: SceneCache | None) -> None:
    """Raise NotEnoughMemory, before anything is built, if this scene does not fit. What is kept is let go of first."""
    needed, there = expected(scene, settings, pixels), memory.available()
    if cache is not None and there is not None and sum(needed.values()) > there:
        cache.forget()
        there = memory.available()
    by_mesh = triangles_by_mesh(scene)
    if by_mesh:
        number, most = by_mesh.most_common(1)[0]
        total = sum(by_mesh.values())
        name = f"{total / 1e6:.1f} million triangles ({most / total:.0%} of mesh {scene.meshes[number].name!r})"
        needed = {name: needed.pop("geometry") + needed.pop("search trees"), **needed}
    memory.require(needed, ADVICE, there)


def taken(scene: Scene, geometry: Geometry, film: Iterable[np.ndarray[Any, Any]]) -> dict[str, object]:
    """Bytes that a scene has taken, by what for; those of trees are estimated, since Embree does not tell.

    "textures" : all of them; "by_texture" : name -> bytes, the largest first. "peak" : of the process, since it began.
    """
    textures = of_textures(scene)
    return {
        "peak": memory.peak(),
        "meshes": sum(_bytes_of(mesh) for mesh in scene.meshes),
        "geometry": _bytes_of(geometry) + (0 if geometry.instanced is None else _bytes_of(geometry.instanced)),
        "search_trees": geometry.triangle_count * TREE_BYTES,
        "film": sum(array.nbytes for array in film),
        "textures": sum(textures.values()),
        "by_texture": textures,
    }


def of_textures(scene: Scene) -> dict[str, int]:
    """Bytes of each image by its name, the largest first. What several textures share counts once."""
    found: Counter[str] = Counter()
    seen: set[int] = set()
    of_surfaces = [e.data for s in scene.surfaces for e in expressions_of(s) if isinstance(e.data, Texture)]
    for texture in (*of_surfaces, *images_of(scene.world)):
        for part in texture.parts:
            if id(part.stored) not in seen:
                seen.add(id(part.stored))
                found[texture.name] += part.nbytes
    return dict(found.most_common())


def triangles_by_mesh(scene: Scene) -> Counter[int]:
    """Mesh -> triangles that are made of it, or kept: of all its instances, or once (see `geometry.instanced`)."""
    kept = set(saved_by_instancing(scene)) if has_kernels() else set()
    solids = _may_be_solids(scene.surfaces) if kept else np.zeros(0, bool)
    worn: dict[int, list[tuple[int, ...]]] = {}
    for instance in scene.instances:
        worn.setdefault(instance.mesh, []).append(instance.surfaces)
    found: Counter[int] = Counter()
    for number, surfaces in worn.items():
        mesh, times = scene.meshes[number], len(surfaces)
        if number in kept:
            alone = int(np.count_nonzero(closed_wear(mesh, surfaces, solids)))
            times = min(alone + 1, times)
        found[number] = times * len(mesh.triangles)
    return found


def _may_be_solids(surfaces: Sequence[Surface]) -> NDArray[np.bool_]:
    """(s,) whose closed bodies may be solids: all clear ones, once any refracts or absorbs."""
    clear = np.array([any(_is_below_one(part.opacity) for part in s.parts) for s in surfaces], bool)
    bends = np.array([any(s.absorption) or any(_may_bend(part) for part in s.parts) for s in surfaces], bool)
    whole = np.array([not (s.culled or s.shadow_culled) for s in surfaces], bool)
    return np.asarray(clear & (bends | whole) & (clear & bends).any())


def _may_bend(part: Surface) -> bool:
    return _is_below_one(part.opacity) and not (part.thin or (isinstance(part.ior, float) and part.ior == 1.0))


def _is_below_one(opacity: Any) -> bool:
    return not isinstance(opacity, (int, float)) or opacity < 1


def _bytes_of(owner: Any) -> int:
    """Of the arrays that a dataclass holds, in mappings too."""
    values = [getattr(owner, field.name) for field in fields(owner)]
    values += [item for value in values if isinstance(value, dict) for item in value.values()]
    return sum(value.nbytes for value in values if isinstance(value, np.ndarray))
