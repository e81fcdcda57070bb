# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits the table of linearly transformed cosines for highlights on rough surfaces (tracer/shading/ltc.npy).

Run once (`python tools/fit_ltc.py`, some minutes); the table is committed. After Heitz, Dupuy, Hill and Neubelt 2016,
Real-Time Polygonal-Light Shading with Linearly Transformed Cosines, sec. 4: the axis of the distribution is the mean
direction of the lobe, and the three numbers of its matrix minimise the cubed error by the downhill simplex method. What
is new is what is tabulated: numbers relative to the mirror's direction and to alpha, which stay smooth and finite where
the lobe becomes a mirror.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SIZE = 32
"""Steps of roughness, and of the square root of 1 - cosine."""
SIDE = 40
"""Directions that are summed for each of both densities: SIDE x SIDE."""
STEPS = 160
"""Of the simplex."""
LEAST = 1e-4
"""Least cosine, and least length of a matrix's column over alpha."""


def main() -> None:
    """Fit row by row of roughness, from rough to smooth: each starts from what the one before found."""
    table = np.zeros((4, SIZE, SIZE), np.float32)
    start = None
    for row in range(SIZE - 1, 0, -1):
        values, error = fit(row / (SIZE - 1), start)
        start = values[1:]
        table[:, row] = values
        print(f"roughness {row / (SIZE - 1):.3f}: mean absolute error {error.mean():.4f}, largest {np.max(error):.4f}")
        sys.stdout.flush()
    table[:, 0] = table[:, 1]  # relative to alpha: what is smoother than the first row has its shape
    path = Path(__file__).resolve().parents[1] / "hybrid_addon" / "tracer" / "shading" / "ltc.npy"
    np.save(path, table)
    print(f"{path.name}: {path.stat().st_size} bytes")


def fit(roughness: float, start: Array | None) -> tuple[Array, Array]:
    """(4, SIZE) numbers of the table for all cosines, and the absolute error of each fit (SIZE,)."""
    alpha = roughness**2
    cos = np.maximum(1 - (np.arange(SIZE) / (SIZE - 1)) ** 2, LEAST)
    lobe = Lobe(cos, alpha)
    angle = lobe.mean_angle()
    guess = np.stack([np.ones(SIZE), np.ones(SIZE), np.zeros(SIZE)]) if start is None else start
    found = simplex(lambda numbers: lobe.error(numbers, angle, 3.0), guess)
    found[:2] = np.maximum(np.abs(found[:2]), LEAST)
    tilt = (angle - np.arccos(cos)) / alpha
    return np.concatenate([tilt[None], found]), lobe.error(found, angle, 1.0)


class Lobe:
    """GGX lobes times the cosine, normalised, seen at cosines (SIZE,); directions are (3, SIZE, SIDE * SIDE)."""

    def __init__(self, cos: Array, alpha: float) -> None:
        self.cos, self.alpha = cos[:, None], alpha
        self.sin = np.sqrt(1 - self.cos**2)
        steps = (np.arange(SIDE) + 0.5) / SIDE
        self.u, self.v = (a.ravel()[None] for a in np.meshgrid(steps, steps))
        self.own = self._sampled()
        f, pdf = self._raw(self.own)
        self.total = np.where(pdf > 0, f / np.where(pdf > 0, pdf, 1), 0).mean(axis=1, keepdims=True)

    def _sampled(self) -> Array:
        """Reflected off visible microfacets (Heitz 2018)."""
        x, z = self.sin * self.alpha, self.cos
        length = np.sqrt(x * x + z * z)
        x, z = x / length, z / length
        phi, cap = 2 * np.pi * self.u, 1 - self.v * (1 + z)
        s = np.sqrt(np.maximum(1 - cap * cap, 0))
        h = np.stack([(s * np.cos(phi) + x) * self.alpha, s * np.sin(phi) * self.alpha, np.maximum(cap + z, 0)])
        h /= np.sqrt((h * h).sum(axis=0))
        wo_h = self.sin * h[0] + self.cos * h[2]
        wi = 2 * wo_h * h
        wi[0] -= self.sin
        wi[2] -= self.cos
        return wi

    def _raw(self, wi: Array) -> tuple[Array, Array]:
        """The lobe times the cosine, not normalised, and the density of `_sampled`; 0 below the horizon."""
        a2 = self.alpha**2
        hx, hy, hz = wi[0] + self.sin, wi[1], wi[2] + self.cos
        length2 = hx * hx + hy * hy + hz * hz
        sin2 = (hx * hx + hy * hy) / length2
        d = a2 / (np.pi * (sin2 + a2 * (1 - sin2)) ** 2)
        cos_i = np.maximum(wi[2], LEAST)
        root_o = np.sqrt(a2 + (1 - a2) * self.cos**2)
        root_i = np.sqrt(a2 + (1 - a2) * cos_i**2)
        both = 2 * self.cos * cos_i / (self.cos * root_i + cos_i * root_o)
        one = 2 * self.cos / (self.cos + root_o)
        above = wi[2] > 0
        return np.where(above, d * both / (4 * self.cos), 0), np.where(hz > 0, d * one / (4 * self.cos), 0)

    def mean_angle(self) -> Array:
        """Angle (SIZE,) of the mean direction from the normal, away from the eye."""
        f, pdf = self._raw(self.own)
        weight = np.where(pdf > 0, f / np.where(pdf > 0, pdf, 1), 0)
        x, z = (self.own[0] * weight).mean(axis=1), (self.own[2] * weight).mean(axis=1)
        return np.arctan2(-x, z)

    def error(self, numbers: Array, angle: Array, power: float) -> Array:
        """Integral (SIZE,) of |lobe - fit|^power over all directions; both densities are drawn from."""
        m11, m22 = (np.maximum(np.abs(n), LEAST)[:, None] * self.alpha for n in numbers[:2])
        m13 = numbers[2][:, None] * self.alpha
        sin, cos = np.sin(angle)[:, None], np.cos(angle)[:, None]
        radius, phi = np.sqrt(self.v), 2 * np.pi * self.u
        w = np.stack([radius * np.cos(phi), radius * np.sin(phi), np.sqrt(1 - self.v)])
        local = np.stack([m11 * w[0] + m13 * w[2], m22 * w[1], w[2] + 0 * m11])
        local /= np.sqrt((local * local).sum(axis=0))
        # Away from the eye is -x; the axis of the fit is (-sin, 0, cos), and its x (-cos, 0, -sin).
        drawn = np.stack([-cos * local[0] - sin * local[2], local[1], -sin * local[0] + cos * local[2]])
        total = np.zeros(len(angle))
        for wi in (drawn, self.own):
            f, pdf = self._raw(wi)
            x, z = -cos * wi[0] - sin * wi[2], -sin * wi[0] + cos * wi[2]
            a, b = (x - m13 * z) / m11, wi[1] / m22
            length2 = a * a + b * b + z * z
            density = np.maximum(z, 0) / (np.pi * m11 * m22 * length2 * length2)
            f = f / self.total
            both = pdf + density
            error = np.abs(f - density) ** power
            total += np.where(both > 0, error / np.where(both > 0, both, 1), 0).mean(axis=1)
        return total


def simplex(call: Callable[[Array], Array], start: Array) -> Array:
    """The minima of a function of (3, n) -> (n,), all n at once, by the downhill simplex method (Nelder, Mead 1965)."""
    n = start.shape[1]
    corners = np.stack(
        [start] + [start + 0.1 * np.eye(3)[:, i, None] * np.maximum(np.abs(start), 0.5) for i in range(3)]
    )
    values = np.stack([call(c) for c in corners])
    pick = np.arange(n)
    for _ in range(STEPS):
        order = np.argsort(values, axis=0)
        corners = np.take_along_axis(corners, order[:, None, :], axis=0)
        values = np.take_along_axis(values, order, axis=0)
        center, worst = corners[:3].mean(axis=0), corners[3]
        mirrored = center + (center - worst)
        v_mirrored = call(mirrored)
        # Further where that is the best so far, half the way back where it is among the worst.
        factor = np.where(v_mirrored < values[0], 2.0, np.where(v_mirrored < values[3], 0.5, -0.5))
        other = center + factor * (center - worst)
        v_other = call(other)
        accept = (v_mirrored >= values[0]) & (v_mirrored < values[2])
        best = np.where(~accept & (v_other < v_mirrored), 1, 0)
        new = np.where(best, other, mirrored)
        v_new = np.where(best, v_other, v_mirrored)
        shrink = v_new >= values[3]
        corners[3], values[3] = np.where(shrink, worst, new), np.where(shrink, values[3], v_new)
        if shrink.any():
            closer = corners[:1] + 0.5 * (corners - corners[:1])
            corners = np.where(shrink, closer, corners)
            v = np.stack([call(c) for c in corners])
            values = np.where(shrink, v, values)
    return corners[np.argmin(values, axis=0), :, pick].T


if __name__ == "__main__":
    main()
