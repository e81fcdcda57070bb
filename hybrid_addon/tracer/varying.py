"""Surfaces that vary: at each hit their expressions are worked out, and the hit gets a column of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields as dataclass_fields
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..expressions import Evaluation
from ..scene import Expression, Float32, Float64, Surface
from .geometry import Geometry
from .hitdata import HitData, Numbers
from .interaction import Interaction
from .layers import Lobes, layered_columns
from .surfaces import VARIABLE, Fields, SurfaceTable, columns, constants
from .vectors import dot

Turned = Callable[[int, Numbers, Evaluation, HitData], Float32]
Bools = NDArray[np.bool_]

SHARES = ("reflectivity", "opacity", "roughness", "coat_roughness", "sheen_roughness", "interface_tint")


def resolve(geometry: Geometry, at: Interaction, distance: Float64) -> Interaction:
    """The hits with columns of their own where their surfaces vary; normal maps applied. distance: (n,) along the ray.

    Surfaces are worked out one after the other, each for all its hits.
    """
    n_shading = at.n_shading

    def turned(number: int, index: Numbers, evaluate: Evaluation, data: HitData) -> Float32:
        nonlocal n_shading
        normal = at.table.surfaces[number].normal
        if normal is not None:
            n_shading = n_shading.copy() if n_shading is at.n_shading else n_shading
            n_shading[:, index] = data.facing_normal(evaluate(normal))
        return n_shading[:, index]

    table, surface = _columns(
        geometry, at.table, at.surface, at.prim, at.point, at.entering, at.n_shading, at.wo, distance, turned
    )
    return at if surface is at.surface else replace(at, table=table, surface=surface, n_shading=n_shading)


def resolve_crossings(
    geometry: Geometry,
    table: SurfaceTable,
    prim: Numbers,
    point: Float64,
    entering: Bools,
    normal: Float64,
    wi: Float32,
) -> tuple[SurfaceTable, Numbers]:
    """Table and columns (n,) for points where shadow rays along wi cross primitives, with normals against wi."""
    surface = geometry.surface.take(prim)
    return _columns(
        geometry, table, surface, prim, point, entering, normal.astype(np.float32), -wi, np.zeros(len(prim)), None
    )


def _columns(
    geometry: Geometry, table: SurfaceTable, surface: Numbers, prim: Numbers, point: Float64, entering: Bools,
    normal: Float32, wo: Float32, distance: Float64, turned: Turned | None,
) -> tuple[SurfaceTable, Numbers]:  # fmt: skip
    """The table with more columns, and the column of each hit; `turned` may give other normals."""
    varies = np.flatnonzero(table.varies.take(surface))
    if len(varies) == 0:
        return table, surface
    column, static = surface.copy(), table
    for number in np.unique(surface[varies]).tolist():
        index = varies[surface[varies] == number]
        data = HitData(
            geometry, number, prim[index], point[:, index], entering[index], normal[:, index], wo[:, index],
            distance[index],
        )  # fmt: skip
        evaluate, worn = Evaluation(data), static.surfaces[number]
        n = normal[:, index] if turned is None else turned(number, index, evaluate, data)
        cos = np.abs(dot(wo[:, index], n)).astype(np.float64)
        column[index] = table.columns + np.arange(len(index))
        table = _extended(table, number, _fields(worn, evaluate, len(index)), cos)
    return table, column


def _fields(surface: Surface, evaluate: Evaluation, n: int) -> Fields:
    """All fields of a surface at n hits, within their limits."""
    fields = {}
    for name, size in VARIABLE.items():
        value = getattr(surface, name)
        if value is None:
            continue
        if not isinstance(value, Expression):
            plain = np.array(value, np.float64).reshape(-1, 1)
        else:
            plain = np.maximum(np.nan_to_num(evaluate(value).astype(np.float64)), 0)
            plain = np.minimum(plain, 1) if name in SHARES else plain
        fields[name] = np.broadcast_to(plain[:size], (size, n))
    return {**fields, **{name: np.full((1, n), value) for name, value in constants(surface).items()}}


def _extended(table: SurfaceTable, number: int, fields: Fields, cos: Float64) -> SurfaceTable:
    """The table with columns for n more hits of surface `number`."""
    n, lobes = len(cos), None
    if table.surfaces[number].layered:
        new, lobes = layered_columns(fields, cos)
    else:
        new = columns(fields)
    joined: dict[str, Any] = {}
    for field in dataclass_fields(SurfaceTable):
        old = getattr(table, field.name)
        if isinstance(old, np.ndarray):
            more = new[field.name] if field.name in new else np.full(n, old[number])
            joined[field.name] = np.concatenate([old, more], axis=-1)
    return replace(table, **joined, lobes=_joined(table, lobes, n))


def _joined(table: SurfaceTable, lobes: Lobes | None, n: int) -> Lobes | None:
    """The lobes of all columns; None while no surface has layers."""
    if table.lobes is None and lobes is None:
        return None
    old, new = table.lobes or _none(table.columns), lobes or _none(n)
    pairs = ((getattr(old, f.name), getattr(new, f.name)) for f in dataclass_fields(Lobes))
    return Lobes(*(np.concatenate(pair, axis=-1) for pair in pairs))


def _none(n: int) -> Lobes:
    zero, black = np.zeros(n, np.float32), np.zeros((3, n), np.float32)
    return Lobes(np.zeros(n, bool), black, zero, black, zero, zero, zero)
