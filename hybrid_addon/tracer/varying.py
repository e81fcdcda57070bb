"""Surfaces that vary: each hit on one gets columns of its own, by its cosine and by what the expressions give there."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..expressions import Evaluation
from ..scene import Float32, Float64, Surface
from .columns import ROWS, Columns, plain_columns
from .fields import fields_of, limited
from .geometry import Geometry
from .hitdata import HitData, Numbers
from .interaction import Interaction
from .layers import layered_columns
from .surfaces import SurfaceTable
from .tabulated import factors
from .vectors import ALL, Index, count, dot, flatnonzero, select, take

Bools = NDArray[np.bool_]


def resolve(geometry: Geometry, at: Interaction, distance: Float64) -> Interaction:
    """The hits with columns of their own where their surfaces vary, and normal maps applied.

    distance : (n,) along the rays.
    """
    varies = select(at.table.varies.take(at.surface))
    if count(varies, len(at.surface)) == 0:
        return at
    some = _Varying(geometry, at.table, at.prim, at.point, at.entering, at.n_shading, at.wo, distance, varies)
    n_shading = some.turn(at.n_shading)
    columns, column = some.columns(n_shading)
    return replace(at, columns=columns, column=column, n_shading=n_shading)


def resolve_crossings(
    geometry: Geometry,
    table: SurfaceTable,
    prim: Numbers,
    point: Float64,
    entering: Bools,
    normal: Float64,
    wi: Float32,
) -> tuple[Columns, Index]:
    """Columns, and those of n points where shadow rays along wi cross primitives, with normals against wi.

    Of columns there are the rows CROSSING alone.
    """
    varies = select(table.varies_through.take(geometry.surface.take(prim)))
    n = normal.astype(np.float32)
    some = _Varying(geometry, table, prim, point, entering, n, -wi, np.zeros(len(prim)), varies)
    return some.columns(n, crossing=True)


@dataclass(frozen=True, eq=False)
class _Worn:
    """A surface with expressions, and the hits on it: among those that vary, and among all."""

    number: int
    surface: Surface
    members: Index
    hits: Index
    data: HitData
    evaluate: Evaluation


class _Varying:
    """The hits `varies`, m of n, on surfaces that vary; what expressions give for each of these surfaces."""

    def __init__(
        self, geometry: Geometry, table: SurfaceTable, prim: Numbers, point: Float64, entering: Bools,
        normal: Float32, wo: Float32, distance: Float64, varies: Index,
    ) -> None:  # fmt: skip
        self.table, self.varies, self.wo = table, varies, take(wo, varies)
        self.all_surfaces = geometry.surface.take(prim)
        self.surface = take(self.all_surfaces, varies)
        self.expressive: list[_Worn] = []
        worn = flatnonzero(np.bincount(self.surface, minlength=len(table.varies)))
        for number in worn[table.expressive[worn]].tolist():
            members = select(self.surface == number)
            index = members if isinstance(varies, slice) else take(varies, members)
            data = HitData(
                geometry, number, take(prim, index), take(point, index), take(entering, index), take(normal, index),
                take(wo, index), take(distance, index),
            )  # fmt: skip
            self.expressive.append(_Worn(number, table.surfaces[number], members, index, data, Evaluation(data)))

    def turn(self, n_shading: Float32) -> Float32:
        """Shading normals (3, n) with normal maps applied."""
        mapped = [worn for worn in self.expressive if worn.surface.normal is not None]
        result = n_shading.copy() if mapped else n_shading
        for worn in mapped:
            assert worn.surface.normal is not None
            result[:, worn.hits] = worn.data.facing_normal(worn.evaluate(worn.surface.normal))
        return result

    def columns(self, normal: Float32, crossing: bool = False) -> tuple[Columns, Index]:
        """Columns, and those of all n hits with normals (3, n). crossing: the rows CROSSING alone."""
        cos = np.abs(dot(self.wo, take(normal, self.varies))).astype(np.float64)
        row = self.table.tabulated.row.take(self.surface)
        known = select(row >= 0)
        values = self.table.tabulated.columns(take(row, known), take(cos, known), crossing)
        if not isinstance(known, slice):
            found, values = values, np.empty((len(values), len(cos)), np.float32)
            values[:, known] = found
        for worn in self.expressive:
            self._express(worn, cos, values, crossing)
        if isinstance(self.varies, slice):
            return Columns(values), ALL
        static = self.table.columns.values[: len(values)]
        column = self.all_surfaces.copy()
        column[self.varies] = static.shape[1] + np.arange(len(cos))
        return Columns(np.concatenate([static, values], axis=1)), column

    def _express(self, worn: _Worn, cos: Float64, values: Float32, crossing: bool) -> None:
        """Write into values (rows, m) what expressions tell of the hits on one surface."""
        surface, evaluate, members = worn.surface, worn.evaluate, worn.members
        if self.table.tabulated.row[worn.number] >= 0:
            for name in () if crossing else factors(surface):
                values[ROWS[name], members] *= limited(name, evaluate(getattr(surface, name)))
            return
        cos = take(cos, members)
        fields = fields_of(surface, evaluate, self.table.known[crossing][worn.number])
        found = layered_columns(fields, cos) if surface.layered else plain_columns(fields, len(cos))
        values[:, members] = found[: len(values)]
