"""Which passes a picture takes: all samples at once, where they are needed, or as many as there is time for.

Against a deadline the passes are short and go from coarse to fine: one sample of every 8th pixel across and up, then of
every 4th, of every 2nd, of all; then 2, 4, 8, ... samples. So what is given up for want of time is, in this order,
samples, then resolution. Bounces and the cutoff never are: a coarse picture is better than a black glass. Time that is
left but too short for a whole pass goes to the pixels that differ most from their neighbours. A picture that was in
time is the same, bit for bit, as one without a deadline.
"""

from __future__ import annotations

import math
import time
from collections import Counter

import numpy as np

from ...scene import Float32
from ..core.constants import COARSEST, FIRST_SAMPLES, SAMPLING_SLOPE
from ..core.vectors import evenly
from ..film.pixels import ESTIMATED, SEEN, PixelBuffer, neighbours_rmse
from ..prepare.compiled import CompiledScene
from .adaptive import Audit, choose, looks, unsettled
from .passes import Pass, Passes, Pixels

END = 0.95
"""The fraction of the progress at which all samples are taken."""

IN_TIME, WORTH_IT = 0.8, 1 / 16
"""Of the samples that the time left should allow, those that are asked for where they show most, which is where they
take longest; and of all pixels how many these must be, to be worth looking for."""

EVEN = "their pixels are even (adaptive)"
"""Why samples are left out."""


class Schedule:
    """The passes over the pixels of one window.

    skipped, sampling : what was left out, and what to expect of the samples (see `scene.Film`).
    """

    def __init__(
        self, scene: CompiledScene, passes: Passes, pixel_buffer: PixelBuffer, weight: Float32 | None, deadline: float
    ) -> None:
        """weight: (n,) share of the picture that is the pixel's; None: 1."""
        self.scene, self.settings = scene, scene.settings
        self.passes, self.pixel_buffer, self.weight = passes, pixel_buffer, weight
        self.pixels: Pixels = np.arange(len(passes.grid))
        self.began, self.deadline = time.perf_counter(), deadline
        self.adaptive = is_adaptive(scene)
        self.done = 0.0
        self.skipped: Counter[tuple[str, str]] = Counter()
        self.sampling: dict[str, object] = {}
        self._audit: Audit | None = None

    @property
    def hurries(self) -> bool:
        """There is a deadline."""
        return self.deadline < math.inf

    def run(self) -> None:
        """Take the samples.

        Against a deadline each pass is as long as all before it or as the time allows.
        """
        samples, pixels, taken, in_time = self.settings.samples, self.pixels, 0, True
        stops = looks(samples) if self.adaptive else []
        audit = Audit(self.pixel_buffer, self.settings.seed) if self.adaptive else None
        if self.hurries:
            taken, in_time = 1, self._coarse_to_fine()
        while in_time and taken < samples and len(pixels):
            if audit is not None and taken in stops:
                pixels = self._go_on(pixels, taken, audit)
                if len(pixels) == 0:
                    break
            count = next((stop for stop in stops if stop > taken), samples) - taken
            if self.hurries:
                count = min(count, taken, self._affordable() // len(pixels))
            if count == 0:
                self._where_it_shows(pixels, taken)
                break
            in_time = self._pass(pixels, taken, count)
            taken += count
        if self.hurries:
            taken_of = self.pixel_buffer.samples[pixels]
            self._skip("samples", "the time budget: samples go first", int((samples - taken_of).sum()))
            copied = int((taken_of == 0).sum())
            self._skip("resolution", "the time budget: when no samples are left to give up, pixels go", copied)
        self._audit = audit
        taken_of = self.pixel_buffer.samples[self.passes.grid.window >= 0]
        self.sampling["samples_mean"] = float(taken_of.mean()) if len(taken_of) else 0.0
        self.sampling["samples_max"] = int(np.max(taken_of, initial=0))

    def _coarse_to_fine(self) -> bool:
        """The first sample of all pixels. Of the coarsest raster that meets any it is taken whatever the time."""
        step, coarser = COARSEST, np.zeros(len(self.pixels), bool)
        x, y = self.passes.grid.at(self.pixels)
        deadline = math.inf
        while step >= 1:
            met = (x % step == 0) & (y % step == 0)
            pixels = self.pixels[met & ~coarser]
            if len(pixels):
                if not self._pass(pixels, 0, 1, deadline):
                    return False
                deadline = self.deadline
            coarser, step = met, step // 2
        return True

    def _pass(self, pixels: Pixels, first: int, count: int, deadline: float | None = None) -> bool:
        """Take more samples of some pixels; whether there was time for all."""
        signed = self.adaptive and first < FIRST_SAMPLES
        work = Pass(first, count, self.scene.seen_by_camera, self.settings.samples > 1, signed)
        progress = self._fractions(first + count == self.settings.samples)
        return self.passes.run(pixels, work, progress, self.deadline if deadline is None else deadline)

    def _affordable(self) -> int:
        """How many samples the time that is left should allow, by what they cost so far."""
        now, taken = time.perf_counter(), int(self.pixel_buffer.samples.sum())
        each = (now - self.began) / max(taken, 1)
        left = max(self.deadline - now, 0.0)
        return int(min(left / max(each, 1e-9), self.settings.samples * len(self.pixels)))

    def _where_it_shows(self, pixels: Pixels, taken: int) -> None:
        """One sample more, for which there is no time in all pixels, in those that differ most from a neighbour."""
        number = int(IN_TIME * self._affordable())
        if len(pixels) * WORTH_IT < number < len(pixels):
            differs = self.pixel_buffer.beside_neighbours(self.weight)[pixels]
            self._pass(np.sort(pixels[np.argpartition(differs, -number)[-number:]]), taken, 1)

    def _fractions(self, is_last: bool) -> tuple[float, float]:
        """Progress before and after a pass: the time that has passed if it is limited; else a half of what is left."""
        done = self.done
        if self.hurries:
            done = min((time.perf_counter() - self.began) / max(self.deadline - self.began, 1e-9), END)
        self.done = done if self.hurries else END if is_last else (done + END) / 2
        return done, self.done

    def _go_on(self, pixels: Pixels, taken: int, audit: Audit) -> Pixels:
        """The pixels that take more samples: those that need them, and some of the others as a check."""
        needs = choose if taken == FIRST_SAMPLES else unsettled
        needed = needs(self.pixel_buffer, pixels, self.weight, self.settings.adaptive)
        needed |= audit.going_on[pixels]
        cache = audit.keep(self.pixel_buffer, pixels[~needed])
        left = np.union1d(pixels[needed], cache)
        even = (len(pixels) - len(left)) * (self.settings.samples - taken)
        self._skip("samples", EVEN, even)
        return left

    def note_errors(self) -> None:
        """The error to expect of the samples, over the traced pixels and as they show."""
        if self._audit is not None and self._audit.left_alone:
            self.sampling["audit"] = self._audit.result(self.pixel_buffer, self.settings.adaptive)
        pixels = evenly(self.passes.grid.window >= 0, ESTIMATED)
        variance = self.pixel_buffer.variance_of_mean(pixels)
        if self.weight is not None:
            variance *= self.weight[pixels] ** 2
        known = variance[np.isfinite(variance)]
        square, share = float(known.sum(dtype=np.float64)) / max(len(known), 1), len(known) / max(len(variance), 1)
        others = self._rmse_from_neighbours() if share < 1 else 0.0
        # Of one sample each, with a few pixels that got more because none counted, these few say little of the rest.
        both = share * square + (1 - share) * (others or 0.0) ** 2
        unknown = (others is None and share == 0) or not math.isfinite(both)
        self.sampling["rmse"] = None if unknown else math.sqrt(both)
        self.sampling["slope"] = SAMPLING_SLOPE

    def _rmse_from_neighbours(self) -> float | None:
        """Of one sample a pixel, or less."""
        if len(self.pixels) == 0:
            return None
        traced = self.pixel_buffer.given[0, SEEN] > 0
        return neighbours_rmse(self.pixel_buffer.mean, self.passes.grid, traced, self.weight)

    def _skip(self, what: str, why: str, number: int) -> None:
        if number:
            self.skipped[what, why] += number


def is_adaptive(scene: CompiledScene) -> bool:
    """Whether some pixels may take fewer samples than others."""
    return scene.settings.adaptive > 0 and scene.settings.samples > FIRST_SAMPLES
