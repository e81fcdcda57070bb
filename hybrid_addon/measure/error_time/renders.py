# SPDX-License-Identifier: GPL-3.0-or-later
"""What a report varies, and pictures of one scene at any quality."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...clock import Clock
from ...presets import Quality
from ...scene import Expression, Film, Float32, Scene, Settings, Surface
from ...tracer import CompiledScene, trace_compiled
from ...tracer.core.constants import FIRST_SAMPLES
from ...tracer.emitters.environment import brightest
from ...tracer.prepare.tables import describe
from ...tracer.prepare.validate import validate
from ...tracer.sampling.passes import Progress
from ...tracer.shading.lamps import brightest_lamp
from .regions import object_ids

BRIGHTER = 2.0
"""What a cut ray would have met is taken to be at most so many times as bright as the brightest pixel, or as the world
what emits and lamps if these are brighter: an estimate, since a highlight may be brighter still."""

CUTOFFS = (5e-5, 1e-3)
"""The reference follows what brings more than the first: below what its samples resolve. Without a cutoff the paths
between mirrors and half clear glass multiply with every bounce. The second where it is below that, too, and pays."""


@dataclass(frozen=True)
class Axes:
    """The settings to combine, and how deep the reference is.

    reference_samples : at most, if there is time for them; patient: so many, however long they take.
    repeats : timed runs of each, if there is time for them.
    """

    samples: tuple[int, ...] = (1, 4, 16, 64)
    max_depth: tuple[int, ...] = (1, 2, 4, 8, 16, 32)
    cutoff: tuple[float, ...] = (1e-3, 1 / 255, 1 / 64)
    adaptive: tuple[float, ...] = (0.0, 0.05)
    reference_samples: int = 2048
    reference_cutoff: float = CUTOFFS[0]
    patient: bool = False
    repeats: int = 5

    @property
    def deepest(self) -> int:
        """The reference's bounces: twice the largest asked for."""
        return 2 * max(*self.max_depth, 1)

    @property
    def exact(self) -> Quality:
        """What bounces and cutoff are compared with. Few samples: they cancel out. One is not filtered, costs more."""
        return Quality(FIRST_SAMPLES, self.deepest, CUTOFFS[0], 0.0)

    def deep(self, samples: int) -> Quality:
        """These samples with as good as nothing cut off, as in the reference."""
        return Quality(samples, self.deepest, self.reference_cutoff, 0.0)


class Renders:
    """A scene prepared once, and pictures of it at any quality, as they show in the composite.

    mask : (h, w), coverage of the ray traced objects in EEVEE's picture, or None: the tracer draws every pixel.
    """

    def __init__(self, scene: Scene, settings: Settings, mask: Float32 | None) -> None:
        validate(scene, settings, mask)
        self.scene, self.mask = scene, mask
        clock = Clock()
        self._compiled = CompiledScene(scene, settings)
        self.build = clock.read()
        self.ids = object_ids(self._compiled)

    def trace(self, quality: Quality, seed: int = 0, progress: Progress | None = None) -> Film:
        """A film at this quality. Raises Cancelled if progress says so."""
        values: dict[str, Any] = {**quality.values(), "seed": seed}
        settings = replace(self._compiled.settings, **values)
        return trace_compiled(self._compiled.seen_from(self._compiled.camera, settings), self.mask, progress)

    def plan(self, quality: Quality) -> list[dict[str, Any]]:
        """Every pruning, and whether it applies at this quality; a film has that of its compiled scene."""
        values: dict[str, Any] = dict(quality.values())
        return describe(self.scene, replace(self._compiled.settings, **values)).table()

    def shown(self, film: Film) -> Float32:
        """Its radiance (h, w, 3) times coverage: what it adds to the composite."""
        return np.asarray(film.radiance * self.weight(film)[..., None], np.float32)

    def brightest(self, films: Iterable[Film]) -> float:
        """An estimate of the largest radiance along any ray, from all that has been seen."""
        scene = self.scene
        emission = max(map(_brightest, scene.surfaces), default=0.0)
        seen = max((float(np.max(film.radiance, initial=0.0)) for film in films), default=0.0)
        return max(BRIGHTER * seen, brightest(scene.world), emission, brightest_lamp(self._compiled))

    def weight(self, film: Film) -> Float32:
        """Coverage (h, w)."""
        return film.coverage if self.mask is None else self.mask


def _brightest(surface: Surface) -> float:
    """The largest radiance that a surface sends out by itself, as far as constants tell."""
    if not surface.closures:
        return 0.0 if isinstance(surface.emission, Expression) else max(surface.emission)
    parts = [(c.weight, _brightest(c.surface)) for c in surface.closures]
    return sum(emission if isinstance(w, Expression) else float(np.max(w)) * emission for w, emission in parts)
