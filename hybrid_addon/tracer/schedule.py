"""Which passes a picture takes: all samples at once, where they are needed, or as many as there is time for.

Against a deadline the passes are short and go from coarse to fine: one sample of every 8th pixel across and up, then of
every 4th, of every 2nd, of all; then 2, 4, 8, ... samples. So what is given up for want of time is, in this order,
samples, then resolution. Bounces and the cutoff never are: a coarse picture is better than a black glass. A picture
that was in time is the same, bit for bit, as one without a deadline.
"""

from __future__ import annotations

import math
import time

import numpy as np

from ..scene import Float32
from .adaptive import Audit, audit, choose
from .compiled import CompiledScene
from .constants import COARSEST, FIRST_SAMPLES, SAMPLING_SLOPE
from .passes import Pass, Passes, Pixels
from .totals import Totals, neighbours_rmse

END = 0.95
"""The fraction of the progress at which all samples are taken."""


class Schedule:
    """The passes over the wanted pixels of one window.

    skipped, sampling : what was left out, and what to expect of the samples (see `scene.Film`).
    """

    def __init__(
        self,
        scene: CompiledScene,
        passes: Passes,
        totals: Totals,
        pixels: Pixels,
        mask: Float32 | None,
        deadline: float,
    ) -> None:
        x0, y0, x1, y1 = scene.camera.window
        self.scene, self.settings = scene, scene.settings
        self.passes, self.totals, self.pixels, self.mask = passes, totals, pixels, mask
        self.began, self.deadline = time.perf_counter(), deadline
        self.size = (y1 - y0, x1 - x0)
        self.corner = (x0, y0)
        self.adaptive = is_adaptive(scene)
        self.skipped: list[tuple[str, str, int]] = []
        self.sampling: dict[str, object] = {}

    def run(self) -> None:
        """Take the samples, and note what is to be said of them."""
        if self.deadline < math.inf:
            self._progressive()
        else:
            self._whole()
        self._note_errors()

    def _whole(self) -> None:
        """All samples of all pixels, or few of all and the others where they are needed."""
        samples = self.settings.samples
        if not self.adaptive:
            self._pass(self.pixels, 0, samples, (0.0, END))
            return
        self._pass(self.pixels, 0, FIRST_SAMPLES, (0.0, 0.4))
        pixels, check = self._refine()
        self._pass(pixels, FIRST_SAMPLES, samples - FIRST_SAMPLES, (0.4, END))
        self.sampling["audit"] = check.result(self.totals, self.settings.adaptive)

    def _progressive(self) -> None:
        """Coarse to fine, then ever more samples, each pass as long as all before it or as the time allows."""
        pixels, check = self.pixels, None
        taken, in_time = 1, self._coarse_to_fine()
        while in_time and taken < self.settings.samples:
            limit = FIRST_SAMPLES if self.adaptive and taken < FIRST_SAMPLES else self.settings.samples
            if self.adaptive and taken == FIRST_SAMPLES:
                pixels, check = self._refine()
            count = min(taken, limit - taken, self._affordable(len(pixels)))
            in_time = count > 0 and self._pass(pixels, taken, count, self._fractions())
            taken += count
        if check is not None:
            self.sampling["audit"] = check.result(self.totals, self.settings.adaptive)
        taken_of = self.totals.samples[pixels]
        self._skip("samples", "the time budget: samples go first", int((self.settings.samples - taken_of).sum()))
        copied = int((taken_of == 0).sum())
        self._skip("resolution", "the time budget: when no samples are left to give up, pixels go", copied)

    def _coarse_to_fine(self) -> bool:
        """The first sample of all pixels. Of the coarsest raster that meets any it is taken whatever the time."""
        step, coarser = COARSEST, np.zeros(len(self.pixels), bool)
        x, y = self._places(self.pixels)
        deadline = math.inf
        while step >= 1:
            met = (x % step == 0) & (y % step == 0)
            pixels = self.pixels[met & ~coarser]
            if len(pixels):
                if not self._pass(pixels, 0, 1, self._fractions(), deadline):
                    return False
                deadline = self.deadline
            coarser, step = met, step // 2
        return True

    def _pass(
        self, pixels: Pixels, first: int, count: int, progress: tuple[float, float], deadline: float | None = None
    ) -> bool:
        """Take more samples of some pixels; whether there was time for all."""
        signed = self.adaptive and first < FIRST_SAMPLES
        work = Pass(first, count, self.scene.seen_by_camera, self.settings.samples > 1, signed)
        return self.passes.run(pixels, work, self.totals, progress, self.deadline if deadline is None else deadline)

    def _affordable(self, pixels: int) -> int:
        """How many samples of so many pixels the time that is left should allow, by what they cost so far."""
        now = time.perf_counter()
        taken = int(self.totals.samples[self.pixels].sum())
        each = (now - self.began) / max(taken, 1)
        return int(min((self.deadline - now) / max(each * pixels, 1e-9), self.settings.samples))

    def _fractions(self) -> tuple[float, float]:
        """Against a deadline progress is the time that has passed."""
        done = (time.perf_counter() - self.began) / max(self.deadline - self.began, 1e-9)
        return (min(done, END), min(done, END))

    def _refine(self) -> tuple[Pixels, Audit]:
        """The pixels that take all their samples: those that need them, and some of the others as a check."""
        needed = choose(self.totals, self.pixels, self.size, self.mask, self.settings.adaptive)
        alone = self.pixels[~needed]
        check = audit(self.totals, alone, *self._places(alone), self.settings.seed)
        pixels = np.union1d(self.pixels[needed], check.pixels)
        rest = self.settings.samples - FIRST_SAMPLES
        self._skip("samples", "their pixels are even (adaptive)", (len(self.pixels) - len(pixels)) * rest)
        return pixels, check

    def _places(self, pixels: Pixels) -> tuple[Pixels, Pixels]:
        """Absolute x and y (n,) of pixels."""
        width = self.size[1]
        return self.corner[0] + pixels % width, self.corner[1] + pixels // width

    def _note_errors(self) -> None:
        """How many samples there were, and the error to expect of them, over the traced pixels and as they show."""
        taken = self.totals.samples[self.pixels]
        variance = self.totals.variance[self.pixels].astype(np.float64)
        if self.mask is not None:
            variance *= self.mask[self.pixels] ** 2
        known = variance[np.isfinite(variance)]
        self.sampling["samples_mean"] = float(taken.mean()) if len(taken) else 0.0
        self.sampling["samples_max"] = int(np.max(taken, initial=0))
        self.sampling["rmse"] = float(np.sqrt(known.mean())) if len(known) else self._rmse_from_neighbours()
        self.sampling["slope"] = SAMPLING_SLOPE

    def _rmse_from_neighbours(self) -> float | None:
        """Of one sample a pixel, or less."""
        if len(self.pixels) == 0:
            return None
        traced = np.zeros(self.size, bool)
        traced.reshape(-1)[self.pixels] = self.totals.seen[self.pixels] > 0
        weight = np.ones(self.size, np.float32) if self.mask is None else self.mask.reshape(self.size)
        return neighbours_rmse(self.totals.mean, traced, weight, len(self.pixels))

    def _skip(self, what: str, why: str, number: int) -> None:
        if number:
            self.skipped.append((what, why, number))


def is_adaptive(scene: CompiledScene) -> bool:
    """Whether some pixels may take fewer samples than others."""
    return scene.settings.adaptive > 0 and scene.settings.samples > FIRST_SAMPLES
