# SPDX-License-Identifier: GPL-3.0-or-later
"""Disks that face whoever looks at them, as which points, spots and suns are sampled and mirrored."""

from __future__ import annotations

import numpy as np

from ...scene import Float32, Float64
from ..core.sampler import disk
from ..core.vectors import Array, orthonormal_basis
from .form_factors import ellipse_form_factor
from .light import Lobe, UnitSquare


def point_on_facing_disk(toward: Float32, d2: Float32, radius: Array, square: UnitSquare) -> Float32:
    """From the middle of disks of these radii (n,), toward (3, n) away and facing us, to points of them: (3, n)."""
    x, y = disk(*square)
    tangent, bitangent = orthonormal_basis(toward * (1 / np.sqrt(d2)))
    result: Float32 = tangent * (x * radius) + bitangent * (y * radius)
    return result


def lobe_over_facing_disk(lobe: Lobe, toward: Float64, distance: Float64, radius: Float64) -> Float64:
    """Share (n,) of lobes that such disks fill; distance (n,) is the length of toward (3, n), or a little more."""
    tangent, bitangent = orthonormal_basis(toward / distance)
    center, u, v = (lobe.untransformed(a) for a in (toward, tangent * radius, bitangent * radius))
    return ellipse_form_factor(center, u, v)
