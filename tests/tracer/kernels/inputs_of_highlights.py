# SPDX-License-Identifier: GPL-3.0-or-later
"""The same for highlights: form factors, lobes, Phong."""

from __future__ import annotations

from typing import Any

import numpy as np

from hybrid_addon.tracer.shading import ltc

from .inputs import Source, arguments_of


@arguments_of("tracer.emitters.form_factors.form_factor_float32")
def _(s: Source) -> tuple[Any, ...]:
    return *(s.numbers(3) for _ in range(4)), s.units()


@arguments_of("tracer.emitters.form_factors.form_factor_above")
def _(s: Source) -> tuple[Any, ...]:
    return tuple(s.numbers(3, dtype=np.float64) for _ in range(3))


@arguments_of("tracer.emitters.form_factors.ellipse_form_factor")
def _(s: Source) -> tuple[Any, ...]:
    """Of discs, near ones and far ones, too."""
    center, u, v = (s.numbers(3, dtype=np.float64) for _ in range(3))
    size = 10.0 ** s.whole(-6, 2)
    return center, u * size, v * size


@arguments_of("tracer.shading.ltc.lobe_frames")
def _(s: Source) -> tuple[Any, ...]:
    n = s.units()
    wo = n.copy() if s.rng.random() < 0.2 else s.units()
    return wo, n, s.of(s.n).numbers(low=0, high=1).clip(0, 1).astype(np.float32), ltc.ltc_table()


def _lobes(s: Source) -> tuple[Any, ...]:
    return *(s.units(np.float64) for _ in range(3)), s.numbers(3, dtype=np.float64, low=0)


@arguments_of("tracer.shading.ltc.untransformed")
def _(s: Source) -> tuple[Any, ...]:
    return *_lobes(s), s.numbers(3, dtype=np.float64)


@arguments_of("tracer.emitters.light.above_horizon")
def _(s: Source) -> tuple[Any, ...]:
    return s.numbers(3, dtype=np.float64), *(s.numbers(dtype=np.float64, low=0) for _ in range(2)), s.units()


@arguments_of("tracer.shading.scattering.phong_light")
def _(s: Source) -> tuple[Any, ...]:
    cosines = (np.abs(s.numbers(low=0, high=1)) for _ in range(2))  # the twin asks for > 0
    return *(s.units() for _ in range(3)), *cosines, s.numbers(low=0, high=1e4), s.numbers(3, low=0), s.numbers(low=0)
