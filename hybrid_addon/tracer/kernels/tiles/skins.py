# SPDX-License-Identifier: GPL-3.0-or-later
"""Of a tile: how surfaces look where they are hit. Twins of materials/columns.py and materials/tabulated.py."""

# mypy: disable-error-code="no-untyped-def,no-untyped-call,assignment,operator,arg-type,call-arg"

from __future__ import annotations

import numpy as np

from ...core.constants import COSINES
from ..declare import clip, stage
from .images import look_up

F, D = np.float32, np.float64
MOST = np.int64(COSINES - 2)


@stage
def places(skins, surface, cos):
    """Tabulated.look_up: columns (n,), and how far each is on its way to the next."""
    n = len(surface)
    place, share = np.empty(n, np.int64), np.empty(n, F)
    for i in range(n):
        c = cos[i] if cos[i] > F(0) else F(0)  # NaN counts as 0
        s = (c if c < F(1) else F(1)) * skins.steps[surface[i]]
        below = min(np.int64(s), MOST)
        place[i], share[i] = below + skins.first[surface[i]], F(D(s) - D(below))
    return place, share


@stage
def number_of(skins, row, place, share):
    """HitValues.value of a row: (n,)."""
    n = len(place)
    result = np.empty(n, F)
    for i in range(n):
        p = place[i]
        result[i] = skins.values[row, p] + skins.more[row, p] * share[i]
    return result


@stage
def color_of(skins, row, place, share):
    """HitValues.value of three rows: (3, n)."""
    n = len(place)
    result = np.empty((3, n), F)
    for c in range(3):
        for i in range(n):
            p = place[i]
            result[c, i] = skins.values[row + c, p] + skins.more[row + c, p] * share[i]
    return result


@stage
def tint(shapes, skins, images, column, prim, surface, point, color):
    """Multiply colours (3, n) by what images say of them, as evaluate._with_expressions does.

    column : of `Skins.images`.
    """
    n = len(prim)
    numbers, found = np.empty(n, np.int64), 0
    for i in range(n):
        numbers[i] = skins.images[surface[i], column]
        found += numbers[i] >= 0
    if found == 0:
        return
    u, v, factor = np.zeros(n), np.zeros(n), np.empty((3, n), F)
    for i in range(n):
        number = numbers[i]
        if number < 0:
            continue
        p, start, s, t = prim[i], skins.images[surface[i], column + 1], 0.0, 0.0
        if start >= 0:
            x, y, z, planes = point[0, i], point[1, i], point[2, i], shapes.weights
            second = clip(planes[p, 0] * x + planes[p, 1] * y + planes[p, 2] * z + planes[p, 3], 0.0, 1.0)
            third = planes[p, 4] * x + planes[p, 5] * y + planes[p, 6] * z + planes[p, 7]
            third = clip(third, 0.0, 1 - second)
            first, width = (1 - second) - third, shapes.corners.shape[1] // 3
            corners = shapes.corners
            s = corners[p, start] * first + corners[p, width + start] * second + corners[p, 2 * width + start] * third
            start += 1
            t = corners[p, start] * first + corners[p, width + start] * second + corners[p, 2 * width + start] * third
        m = images.mapping[number]
        u[i], v[i] = m[0] * s + m[1] * t + m[2], m[3] * s + m[4] * t + m[5]
    look_up(images, numbers, u, v, factor)
    for c in range(3):
        for i in range(n):
            if numbers[i] >= 0:
                f = factor[c, i] if factor[c, i] > F(0) else F(0)  # no number counts as 0
                if skins.images[surface[i], column + 2] == 1:
                    f = np.sqrt(f if f < F(1) else F(1))
                color[c, i] = color[c, i] * f
