# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves objects, particle hair and point clouds -> scene.TriangleMesh, by `tubes`.

EEVEE's radii: a curve's or point's attribute "radius" (0.01 m where there is none); of a particle's strand half the
*Diameter Root* and *Tip* times *Radius Scale*, between them by *Strand Shape* (hair_shaperadius, draw_hair_lib.glsl).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import bpy
import numpy as np

from ...scene import Float32, Float64, TriangleMesh
from .attributes import FIELDS, generated_of
from .image_file import srgb_to_linear
from .messages import Warnings
from .tubes import Strands, Triangles, balls, smoothed, tubes

RADIUS = 0.01
"""Metres, of curves and points without an attribute of it (draw_cache_impl_curves.cc)."""

CATMULL_ROM, POLY, BEZIER, NURBS = range(4)
"""Of Blender's attribute "curve_type"."""

RESOLUTION = 12
"""Of Blender's curves without an attribute of it."""


def translate_curves(b_object: bpy.types.Object, keys: Iterable[str], warn: Warnings) -> TriangleMesh | None:
    """An evaluated curves object; None if it has no curve."""
    b_curves = b_object.data
    offsets = np.zeros(len(b_curves.curves) + 1, np.int32)
    if len(offsets) < 2 or not len(b_curves.points):
        return None
    b_curves.curve_offset_data.foreach_get("value", offsets)
    given = Strands(
        points=_rows(b_curves, "position", 3, len(b_curves.points)),
        radius=_rows(b_curves, "radius", 1, len(b_curves.points), RADIUS)[:, 0],
        first=offsets.astype(np.intp),
        source=np.arange(len(b_curves.points), dtype=np.float64),
    )
    _warn_of_lacking(b_object, keys, warn)
    m = len(offsets) - 1
    kind = _rows(b_curves, "curve_type", 1, m, CATMULL_ROM)[:, 0].astype(int)
    if (kind == NURBS).any():
        warn.add(f"object {b_object.name!r}: its NURBS curves are traced through their control points")
    resolution = np.where(kind == POLY, 1, _rows(b_curves, "resolution", 1, m, RESOLUTION)[:, 0].astype(np.intp))
    handles = (_rows(b_curves, f"handle_{side}", 3, len(given.points)) for side in ("left", "right"))
    left, right = handles if (kind == BEZIER).any() else (given.points, given.points)
    cyclic = _rows(b_curves, "cyclic", 1, m)[:, 0] != 0
    strands = smoothed(given, resolution, cyclic, (left, right), kind == BEZIER)
    return _mesh(b_object, b_curves.name, strands, tubes(strands), dict(_curve_data(b_curves, strands, given, keys)))


def translate_points(b_object: bpy.types.Object, keys: Iterable[str], warn: Warnings) -> TriangleMesh | None:
    """An evaluated point cloud, a ball for each point; None if it has none."""
    b_cloud = b_object.data
    n = len(b_cloud.points)
    if n == 0:
        return None
    _warn_of_lacking(b_object, keys, warn)
    centers = _rows(b_cloud, "position", 3, n)
    made = balls(centers, _rows(b_cloud, "radius", 1, n, RADIUS)[:, 0])
    data = {key: found for key in keys if (found := _attribute(b_cloud, key, n)) is not None}
    if "generated" in keys:
        data["generated"] = _generated(centers)
    data = {key: found[made.point] for key, found in {**dict(_places(centers, keys)), **data}.items()}
    return _as_mesh(b_cloud.name, made, data)


def translate_hair(
    b_object: bpy.types.Object, b_modifier: bpy.types.ParticleSystemModifier, for_render: bool, subdivided: int,
    keys: Iterable[str], warn: Warnings,
) -> TriangleMesh | None:  # fmt: skip
    """The strands of a particle system, in the object's space; None if it has none.

    for_render : the depsgraph is a render's, which has all children and steps.
    subdivided : `RenderSettings.hair_subdiv`.

    A strand has the emitter's UV maps, colours (of corners, in bytes) and generated coordinates where it begins, as in
    EEVEE (`attr_load_orco` in eevee_attributes_curves_lib.glsl, draw_cache_impl_particles.cc).
    """
    b_system = b_modifier.particle_system
    b_settings = b_system.settings
    numbers = _particles(b_system)
    if len(numbers) == 0:
        return None
    steps = (1 << (b_settings.render_step if for_render else b_settings.display_step)) + 1
    co_hair = b_system.co_hair
    places = [co_hair(b_object, particle_no=number, step=step) for number in numbers for step in range(steps)]
    to_local = np.linalg.pinv(np.array(b_object.matrix_world, np.float64))  # flattened ones, too
    points = np.array(places, np.float64) @ to_local[:3, :3].T + to_local[:3, 3]
    m = len(numbers)
    points, kept = _without_cut_ends(points.reshape(m, steps, 3))
    along = np.tile(np.linspace(0, 1, steps), m)[kept]
    given = Strands(
        points=points.astype(np.float32),
        radius=_hair_radius(b_settings, along),
        first=np.concatenate([[0], np.cumsum(kept.reshape(m, steps).sum(axis=1))]).astype(np.intp),
        source=np.arange(len(points), dtype=np.float64),
    )
    strands = smoothed(given, np.full(m, 1 << subdivided), np.zeros(m, bool))
    data: dict[str, Float32] = dict(_strand_data(strands, keys))
    if "generated" in keys:
        data["generated"] = generated_of(b_object.data, strands.points[strands.first[:-1]])[strands.strand]
    for key in keys:
        kind, _, name = key.partition(":")
        if kind == "uv":
            data[key] = _root_uvs(b_object, b_modifier, numbers, name)[strands.strand]
        elif kind == "color" and name:
            data[key] = _root_colors(b_object, b_modifier, numbers, name, warn)[strands.strand]
    return _mesh(b_object, b_system.name, strands, tubes(strands), data, b_settings.material - 1)


def has_hair(b_modifier: bpy.types.Modifier, for_render: bool) -> bool:
    """Whether EEVEE draws strands for a modifier."""
    if b_modifier.type != "PARTICLE_SYSTEM" or not (b_modifier.show_render if for_render else b_modifier.show_viewport):
        return False
    b_settings = b_modifier.particle_system.settings
    return bool(b_settings.type == "HAIR" and b_settings.render_type == "PATH")


def _particles(b_system: bpy.types.ParticleSystem) -> range:
    """Numbers of those that are drawn, as `co_hair` counts them: the parents, then the children."""
    parents, children = len(b_system.particles), len(b_system.child_particles)
    only_children = children > 0 and not b_system.settings.use_parent_particles
    return range(parents if only_children else 0, parents + children)


def _without_cut_ends(points: Float64) -> tuple[Float64, np.ndarray]:
    """Points (m, k, 3) as (n, 3) without those that lie on the one before (strands cut short), and which (m k,) stay.

    The first two of a strand always stay.
    """
    stays = np.ones(points.shape[:2], bool)
    stays[:, 2:] = (np.diff(points[:, 1:], axis=1) != 0).any(axis=2)
    return points[stays], stays.reshape(-1)


def _hair_radius(b_settings: bpy.types.ParticleSettings, along: Float64) -> Float32:
    """(n,) metres at shares (n,) of the way from root to tip."""
    scale, shape = 0.5 * b_settings.radius_scale, b_settings.shape
    root, tip = b_settings.root_radius * scale, b_settings.tip_radius * scale
    left = np.power(1 - along, 1 + shape if shape < 0 else 1 / (1 - min(shape, 0.999)))
    radius = tip + left * (root - tip)
    if b_settings.use_close_tip:
        radius[along == 1] = 0
    return radius.astype(np.float32)


def _root_uvs(
    b_object: bpy.types.Object, b_modifier: bpy.types.ParticleSystemModifier, numbers: range, name: str
) -> Float32:
    """(m, 2): the emitter's texture coordinates where each strand begins; 0 where it has none."""
    b_system, b_layers = b_modifier.particle_system, b_object.data.uv_layers
    layer = next((i for i, b in enumerate(b_layers) if (b.name == name if name else b.active_render)), None)
    if layer is None:
        return np.zeros((len(numbers), 2), np.float32)
    parents = list(b_system.particles)
    found = [
        b_system.uv_on_emitter(b_modifier, particle=parents[min(n, len(parents) - 1)], particle_no=n, uv_no=layer)
        for n in numbers
    ]
    return np.array([tuple(uv)[:2] for uv in found], np.float32)


def _root_colors(
    b_object: bpy.types.Object,
    b_modifier: bpy.types.ParticleSystemModifier,
    numbers: range,
    name: str,
    warn: Warnings,
) -> Float32:
    """(m, 4): the emitter's colour where each strand begins; black where EEVEE has none for hair."""
    b_system, result = b_modifier.particle_system, np.zeros((len(numbers), 4), np.float32)
    layers = [b for b in b_object.data.attributes if (b.data_type, b.domain) == ("BYTE_COLOR", "CORNER")]
    layer = next((i for i, b_layer in enumerate(layers) if b_layer.name == name), None)
    if layer is None:
        if name in b_object.data.attributes:
            warn.add(
                f"object {b_object.name!r}: hair has no attribute {name!r}, and is black there: only colours of face "
                "corners, in bytes, reach it"
            )
        return result
    alpha = np.zeros(4 * len(layers[layer].data), np.float32)
    layers[layer].data.foreach_get("color", alpha)
    if (alpha[3::4] != 1).any():
        warn.add(f"object {b_object.name!r}: the alpha of attribute {name!r} is 1 for its hair")
    parents = list(b_system.particles)
    found = [
        b_system.mcol_on_emitter(b_modifier, particle=parents[min(n, len(parents) - 1)], particle_no=n, vcol_no=layer)
        for n in numbers
    ]
    result[:, :3], result[:, 3] = srgb_to_linear(np.array([tuple(color) for color in found], np.float32)), 1
    return result


# ------------------------------------------------------------------------------------------------ data


def _curve_data(
    b_curves: bpy.types.Curves, strands: Strands, given: Strands, keys: Iterable[str]
) -> Iterator[tuple[str, Float32]]:
    """(n, width) float32 of the strands' points."""
    yield from _strand_data(strands, keys)
    if "generated" in keys:
        yield "generated", _generated(strands.points[strands.first[:-1]])[strands.strand]
    n, m = len(given.points), len(given.first) - 1
    low = np.floor(strands.source).astype(np.intp)
    high, t = np.minimum(low + 1, n - 1), (strands.source - low)[:, None]
    for key in keys:
        of_points = _attribute(b_curves, key, n, "POINT")
        of_curves = _attribute(b_curves, key, m, "CURVE")
        if of_points is not None:
            yield key, (of_points[low] * (1 - t) + of_points[high] * t).astype(np.float32)
        elif of_curves is not None:
            yield key, of_curves[strands.strand]


def _strand_data(strands: Strands, keys: Iterable[str]) -> Iterator[tuple[str, Float32]]:
    """(n, width): where, and what node Curves Info (Hair Info) tells of a strand (scene.TriangleMesh)."""
    yield from _places(strands.points, keys)
    if "strand" not in keys:
        return
    strand, first = strands.strand, strands.first
    steps = np.zeros(len(strands.points))
    steps[1:] = np.linalg.norm(np.diff(strands.points, axis=0), axis=1)
    steps[first[:-1][first[:-1] < len(steps)]] = 0
    way = np.cumsum(steps)
    way -= way[first[:-1]][strand]
    length = way[first[1:] - 1][strand]
    spread = np.modf(np.arange(1, len(first)) * 0.6180339887498949)[0][strand]  # even, as a hash would be
    share = np.where(length > 0, way / np.where(length > 0, length, 1), 0)
    yield "strand", np.stack([share, length, 2 * strands.radius, spread], axis=1).astype(np.float32)


def _places(points: Float32, keys: Iterable[str]) -> Iterator[tuple[str, Float32]]:
    """(n, 3) local coordinates."""
    if "object" in keys:
        yield "object", points


def _generated(points: Float32) -> Float32:
    """(n, 3) of curves and points, which have no texture space of their own: 0..1 for -1 m..1 m."""
    return points * np.float32(0.5) + np.float32(0.5)


def _attribute(b_data: bpy.types.ID, key: str, count: int, domain: str = "POINT") -> Float32 | None:
    """(count, width) of what a material's key asks for; None: there is none on that domain."""
    kind, _, name = key.partition(":")
    if kind == "uv" and not name:  # the first there is (of hair on a surface its place on that)
        places = (b for b in b_data.attributes if (b.data_type, b.domain) == ("FLOAT2", domain))
        name = next((b_place.name for b_place in places), "")
    b_attribute = b_data.attributes.get(name) if kind in ("uv", "color") and name else None
    if b_attribute is None or b_attribute.data_type not in FIELDS or b_attribute.domain != domain:
        return None
    field, width = FIELDS[b_attribute.data_type]
    values = np.zeros(count * width, np.float32)
    b_attribute.data.foreach_get(field, values)
    rows = values.reshape(count, width)
    if kind == "uv":
        return np.ascontiguousarray(np.pad(rows, ((0, 0), (0, max(2 - width, 0))))[:, :2])
    full = np.ones((count, 4), np.float32)
    full[:, :3] = rows if width == 1 else 0
    full[:, :width] = rows if width > 1 else full[:, :1]
    return full


def _warn_of_lacking(b_object: bpy.types.Object, keys: Iterable[str], warn: Warnings) -> None:
    """Name what a material asks and the curves or points have not: it is 0 there, as in EEVEE."""
    for key in sorted(keys):
        kind, _, name = key.partition(":")
        if kind in ("uv", "color") and name and name not in b_object.data.attributes:
            warn.add(f"object {b_object.name!r} has no attribute {name!r} for its material, which is black there")


def _rows(b_data: bpy.types.ID, name: str, width: int, count: int, default: float = 0.0) -> Float32:
    """(count, width) float32 of an attribute, or of its default."""
    b_attribute = b_data.attributes.get(name)
    if b_attribute is None or len(b_attribute.data) != count:
        return np.full((count, width), default, np.float32)
    values = np.zeros(count * width, np.float32)
    b_attribute.data.foreach_get(FIELDS[b_attribute.data_type][0], values)
    return values.reshape(count, width)


def _mesh(
    b_object: bpy.types.Object, name: str, strands: Strands, made: Triangles, data: dict[str, Float32], slot: int = 0
) -> TriangleMesh:
    corners = {key: values[made.point] for key, values in data.items()}
    last = max(len(b_object.material_slots) - 1, 0)
    return _as_mesh(name, made, corners, min(max(slot, 0), last))


def _as_mesh(name: str, made: Triangles, data: dict[str, Float32], slot: int = 0) -> TriangleMesh:
    """data: of the corners."""
    slots = np.full(len(made.triangles), slot, np.int32) if slot else None
    return TriangleMesh(
        name=name,
        vertices=made.vertices,
        triangles=made.triangles,
        corners=made.corners,
        normals=made.normals,
        uv_maps={key.removeprefix("uv:"): values for key, values in data.items() if key.startswith("uv:")},
        surface_slots=slots,
        attributes={key: values for key, values in data.items() if not key.startswith("uv:")},
    )
