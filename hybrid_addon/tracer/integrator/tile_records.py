# SPDX-License-Identifier: GPL-3.0-or-later
"""What tiles are told of a scene (`kernels/tiles/records.py`)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ...scene import Surface, Texture
from ..core.constants import MAX_BRANCHES
from ..core.vectors import Array
from ..emitters.environment import Sky
from ..emitters.light import CompiledLight
from ..emitters.prefilter import BLUR_ROUGHNESS, BLUR_ROWS
from ..film.error_budget import ErrorBudget
from ..film.path_hash import Identities
from ..film.samples import SampleBuffer
from ..geometry.aggregate import PrimitiveSet
from ..geometry.embree import OwnScene, TriangleScene
from ..kernels.tiles import records as of
from ..materials.textures import EXTENSIONS
from ..prepare.compiled import CompiledScene
from ..shading.ltc import ltc_table
from .tile_obstacles import IN_FACTORS, PLAIN, image_of, stored_as, trees_of


@dataclass(eq=False)
class _Images:
    """Images by number. kept: what addresses point to."""

    kept: list[Array]
    rows: list[tuple[int, list[int], list[float], Array]]
    known: dict[tuple[int, str, bytes], int]

    def number(self, texture: Texture) -> int:
        """Of an image."""
        transform = np.asarray(texture.uv_transform, np.float64)
        key = id(texture.pixels), texture.extension, transform.tobytes()
        if key not in self.known:
            stored, curve = stored_as(texture)
            extension = texture.extension
            along = ("REPEAT", "EXTEND") if extension == "SPHERE" else (extension, extension)
            layout = [int(curve is not None), *stored.shape[:2], *map(EXTENSIONS.index, along)]
            self.kept.append(stored)
            curve = np.zeros(256, np.float32) if curve is None else curve
            self.rows.append((stored.ctypes.data, layout, transform.reshape(-1).tolist(), curve))
            self.known[key] = len(self.rows) - 1
        return self.known[key]


@dataclass(frozen=True, eq=False)
class TileScene:
    """A scene as tiles see it. kept: arrays that it has addresses of."""

    scene: of.Scene
    kept: list[Any]


def records_of(scene: CompiledScene, seen: PrimitiveSet, identity: Identities | None) -> TileScene:
    """The records of a scene for camera rays that see `seen`, if there is nothing that tiles cannot do (`why_not`)."""
    images = _Images([], [], {})
    sets = seen, scene.seen_by_camera, scene.seen_by_secondary, scene.blockers_of_all.casts
    trees = [trees_of(one) or () for one in sets]
    skins, world = _skins(scene, images), _world(scene, images)
    record = of.Scene(
        _shapes(scene, identity),
        _trees(trees),
        skins,
        _images(images),
        world,
        _solids(scene),
        _lamps(scene.lights),
        _lamps(scene.lamps),
        _rules(scene),
    )
    return TileScene(record, [images.kept, trees])


def _fixed(array: Any, dtype: Any) -> Array:
    """As kernels take it: row by row, of this type, not to be written to."""
    result = np.ascontiguousarray(array, dtype).view()
    result.flags.writeable = False
    return result


_f4, _f8, _i4, _i8 = (partial(_fixed, dtype=t) for t in (np.float32, np.float64, np.int32, np.int64))
_b1, _u4, _u8 = (partial(_fixed, dtype=t) for t in (np.bool_, np.uint32, np.uint64))


def _shapes(scene: CompiledScene, identity: Identities | None) -> of.Shapes:
    g = scene.geometry
    smooth = g.normals is not None
    return of.Shapes(
        facets=_f8(g.facets),
        weights=_f8(g.weights),
        extent=_f4(g.extent),
        normals=_f4(g.normals if smooth else np.zeros((0, 9))),
        heights=_f4(g.heights if smooth and scene.plan.shadows else np.zeros((0, 3))),
        smooth=_b1(g.smooth),
        surface=_i8(g.surface),
        object=_i8(g.object),
        ray_traced=_b1(g.ray_traced),
        opaque=_b1(scene.blockers_of_all.opaque),
        casts=_b1(g.shadow),
        corners=_f4(np.zeros((0, 0)) if g.corner_data is None else g.corner_data),
        identity=_u4(np.zeros(0) if identity is None else identity.hashed),
    )


def _trees(sets: list[tuple[TriangleScene, ...]]) -> of.Trees:
    address, start = np.zeros((4, 2), np.uint64), np.full((4, 2), -1)
    known: dict[int, int] = {}
    ids, length = [np.zeros(0, np.int32)], 0
    for number, trees in enumerate(sets):
        for part, tree in enumerate(trees):
            if not tree.size or not isinstance(tree.own, OwnScene):
                continue
            address[number, part] = tree.own.scene.address
            if tree.ids is None:
                continue
            if id(tree.ids) not in known:
                known[id(tree.ids)] = length
                ids.append(tree.ids)
                length += len(tree.ids)
            start[number, part] = known[id(tree.ids)]
    return of.Trees(_u8(address), _i8(start), _i4(np.concatenate(ids)))


def _skins(scene: CompiledScene, images: _Images) -> of.Skins:
    table_ = scene.surfaces
    tabulated = table_.tabulated
    return of.Skins(
        values=_f4(tabulated.columns.values),
        more=_f4(tabulated.columns.more),
        first=_i8(tabulated.first),
        steps=_f4(tabulated.steps),
        ior=_f8(table_.ior),
        flags=_b1([getattr(table_, name) for name in of.FLAGS]),
        images=_i8([_images_of(scene, n, surface, images) for n, surface in enumerate(table_.surfaces)]),
    )


def _images_of(scene: CompiledScene, number: int, surface: Surface, images: _Images) -> list[int]:
    row = []
    for name in IN_FACTORS:
        texture, made = image_of(getattr(surface, name))
        if texture is None:
            row += [-1, -1, PLAIN]
            continue
        layouts = scene.geometry.layouts
        start, width = (layouts[number] if layouts else {}).get("uv:" + texture.uv_map, (-1, 0))
        row += [images.number(texture), start if width and scene.geometry.corner_data is not None else -1, made]
    return row


def _images(images: _Images) -> of.Images:
    rows = images.rows
    return of.Images(
        _u8([row[0] for row in rows]),
        _i8(np.array([row[1] for row in rows]).reshape(-1, 5)),
        _f8(np.array([row[2] for row in rows]).reshape(-1, 6)),
        _f4(np.array([row[3] for row in rows]).reshape(-1, 256)),
    )


def _world(scene: CompiledScene, images: _Images) -> of.World:
    world = scene.world
    skies: tuple[Sky, Sky] = world.skies
    numbers = [-1 if sky.uniform else images.number(_around(sky.panorama)) for sky in skies]
    mean, linear = world.diffuse
    blurred = (
        np.zeros((0, 1, 1, 4)) if skies[0].uniform else np.zeros((len(BLUR_ROUGHNESS), BLUR_ROWS, 2 * BLUR_ROWS, 4))
    )
    for level, image in world.blurred.items():
        blurred[level] = image
    return of.World(
        image=_i8(numbers),
        factor=_f4([sky.factor[:, 0] for sky in skies]),
        rotation=_f4([sky.rotation for sky in skies]),
        limit=_f4([sky.limit for sky in skies]),
        mean=_f4(np.broadcast_to(mean.astype(np.float32).reshape(-1), (3,))),
        linear=_f4(np.zeros((0, 3)) if linear is None else linear),
        blurred=_f4(blurred),
    )


def _around(panorama: Texture) -> Texture:
    """An equirectangular image as one that goes on around."""
    return Texture(panorama.name, panorama.pixels, "SPHERE")


def _solids(scene: CompiledScene) -> of.Solids:
    media = scene.media
    return of.Solids(_i4(media.rank if media.rows else np.zeros(0)), _f8(media.ior), _i8([media.rows]))


def _lamps(lights: Sequence[CompiledLight]) -> of.Lamps:
    rows, kinds, flags, keys = [], [], [], []
    for light in lights:
        kind, row = _lamp(light)
        kinds.append(kind)
        rows.append(row)
        falloff = bool(getattr(light.light, "soft_falloff", False))
        flags.append((light.light.cast_shadow, light.is_soft, falloff))
        keys.append(int(light.key))
    return of.Lamps(
        _i8(kinds), _u4(keys), _b1(np.array(flags).reshape(-1, 3)), _f8(np.array(rows).reshape(-1, of.LAMP_WIDTH)),
        _f8(ltc_table()),
    )  # fmt: skip


def _lamp(compiled: CompiledLight) -> tuple[int, Array]:
    """Its kind, and its numbers."""
    light, known = compiled.light, compiled.as_numbers()
    assert known is not None
    known |= {"place": compiled.position[:, 0], "color": compiled.color[:, 0]}
    known |= {name: getattr(light, name) for name in ("diffuse", "specular", "transmission")}
    known["radiance"] = compiled.radiance()[:, 0] if compiled.has_area else 0.0
    reach = getattr(light, "range", np.inf)
    with np.errstate(all="ignore"):
        known["over_range2"] = np.divide(1.0, reach * reach) if np.isfinite(reach) else 0.0
    row, start = np.zeros(of.LAMP_WIDTH), 0
    for name, width in of.LAMP.items():
        row[start : start + width] = known.get(name, 0.0)
        start += width
    return of.KINDS.index(known["kind"]), row


def _rules(scene: CompiledScene) -> of.Rules:
    plan, settings, camera = scene.plan, scene.settings, scene.camera
    nothing, first = np.zeros(1, np.int64), settings.rough_samples + 1
    budget = ErrorBudget.of(settings.cutoff, settings.max_depth, nothing, nothing, nothing)
    whole = {
        "camera_sees": of.SEES.index(settings.camera_sees), "transparent": settings.transparent, "world": plan.world,
        "ambient": plan.ambient, "diffuse": plan.diffuse, "specular": plan.specular, "shadows": plan.shadows,
        "faint": plan.faint and budget is not None, "emission": plan.emission, "local": plan.local,
        "draws": plan.draws, "shadow_samples": settings.shadow_samples if plan.soft_shadows else 0,
        "unlit": plan.unlit, "light_limit": budget.light_limit if budget else 0, "limit": budget.limit if budget else 0,
        "max_depth": settings.max_depth, "reflection": plan.reflection, "refraction": plan.refraction,
        "most_rays": SampleBuffer.zeros(0, 1, settings.cutoff, (), 0, first).most_rays,
        "most_branches": MAX_BRANCHES * first, "tints": scene.blockers_of_all.tints,
        "objects": int(np.max(scene.geometry.object, initial=-1)) + 1,
        "rough": settings.rough_samples if plan.rough else 0,
    }  # fmt: skip
    real = scene.arriving.indirect, scene.arriving.direct_limit, scene.arriving.indirect_limit, settings.adaptive
    axes = np.asarray(camera.matrix_world, np.float64)[:3]
    radius = scene.geometry.bounds_radius
    numbers = [
        *axes[:, 0], *axes[:, 1], *axes[:, 2], *(axes[:, 3] - scene.geometry.center), *camera.view_plane,
        *camera.resolution, camera.clip_start, camera.clip_end, radius, camera.projection == "PERSP",
    ]  # fmt: skip
    return of.Rules(
        _i8([int(whole[name]) for name in of.WHOLE]),
        _f8(real),
        _f8(numbers),
        _i8(budget.released if budget else np.zeros(1)),
    )
