# SPDX-License-Identifier: GPL-3.0-or-later
"""What the samples of some pixels add up to.

Contributions are float32 and sums float64: they are exact, in any order, as long as what counts lies within 2^29 of the
largest.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...accelerated import accelerated
from ...scene import Float32, Float64, Settings
from ..core.constants import BUDGET_UNIT, MAX_BRANCHES, MOST_RAYS, RAYS_AHEAD
from ..core.rays import BACKGROUND, DRAWN, REFLECTION, REFRACTION, WAY
from ..core.sampler import Draws, Sampler
from ..core.vectors import flatnonzero, largest_component
from .branch_selection import draw
from .error_budget import ErrorBudget, budget_units, sum_of_each
from .path_hash import Signatures

Numbers = NDArray[np.intp]

LOT = np.uint32(0x51ED270B)
"""The dimension of the random numbers that choose among branches."""

LIGHT_AOVS = {
    "reflection": 3, "refraction": 3, "raster_backed": 1, "background": 3, "passed": 3,
    "drawn": 3, "drawn_weight": 3,  "drawn_unfiltered": 3, "drawn_weight_unfiltered": 3,
    "shadowed": 3, "unshadowed": 3, "shadowed_unfiltered": 3, "unshadowed_unfiltered": 3,
}  # fmt: skip
"""Light passes: AOVs that add up with the picture, and their channels."""

UNFILTERED = {name: f"{name}_unfiltered" for name in ("drawn", "drawn_weight", "shadowed", "unshadowed")}
"""Light passes that are also wanted of the pixels' own samples alone: a denoiser wants pixels that share none."""

DRAWN_LIGHT = frozenset(name for name in LIGHT_AOVS if name.startswith("drawn"))
"""Light passes of light that came by ways drawn at random (rough surfaces, fog, subsurface, a lens): the light, and
what of it would arrive if each way brought radiance 1."""

SHADOWED_LIGHT = frozenset(name for name in LIGHT_AOVS if "shadowed" in name)
"""Light passes of light whose shadows are random, on ways that are not: as it arrives, and without these shadows."""

BRANCHES = {"reflection": (REFLECTION,), "refraction": (REFRACTION, BACKGROUND), "background": (BACKGROUND,)}


SEEN_THROUGH = frozenset(("background", "passed"))
"""Light passes that are worked out together."""


def wanted_aovs(settings: Settings) -> list[str]:
    """The light passes that are wanted of samples, and those that come with them."""
    wanted = LIGHT_AOVS.keys() & settings.passes - set(UNFILTERED.values())
    return sorted(wanted | SEEN_THROUGH if wanted & SEEN_THROUGH else wanted)


def resolved_aovs(settings: Settings) -> list[str]:
    """Those of the picture: also UNFILTERED ones."""
    wanted = wanted_aovs(settings)
    return [*wanted, *(UNFILTERED[name] for name in wanted if name in UNFILTERED)]


def branch_rows(settings: Settings) -> int:
    """How many rows of `Rays.branch` the light passes ask for."""
    wanted = set(wanted_aovs(settings))
    if wanted & (DRAWN_LIGHT | SHADOWED_LIGHT):
        return DRAWN + 1
    return 0 if BRANCHES.keys().isdisjoint(wanted) else WAY + 1


def is_drawn(branch: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """(n,) whether light by these branches (2, n) came by a way drawn at random. Not the background's, which is taken
    from the picture again as it is (`compositor.see_through`)."""
    result: NDArray[np.bool_] = (branch[DRAWN] > 0) & (branch[WAY] != BACKGROUND)
    return result


def is_surely_seen(branch: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """(n,) whether nothing of the way is random so far, and what is now is to be told apart."""
    result: NDArray[np.bool_] = (branch[DRAWN] == 0) & (branch[WAY] != BACKGROUND)
    return result


@dataclass(eq=False)
class SampleBuffer:
    """What each of the n samples of m pixels, `count` consecutive ones each, adds up to: float64, in a fixed order.

    radiance : (3, n)   seen : (n,) 1 if it counts   residual : (n,) throughput that was cut off
    stood_for : (n,) the part of the residual that other rays stand for (see `drawn`).
    generation : (n,) int16, bounces of each sample's rays that are being followed.
    followed : (n,) int64, how many rays each sample has become.   most_rays : the most that it may; 0: no limit.
    scratch  : (n,) int64, working space: zeros between calls.
    budget   : how much of its throughput each sample may lose to the cutoff; None: nothing.
    signatures : of the samples' ray trees, or None where nobody asks (see `path_hash`).
    aovs     : the light passes that are wanted, by name: "reflection" and "refraction" (3, n), the radiance that came
               by way of such a ray from the first surface; "raster_backed" (1, n), the throughput that ended at
               raster-backed hits; "background" and "passed" (3, n), the radiance of what is not ray traced and seen
               straight through what is, and the throughput that it came by; those of DRAWN_LIGHT and SHADOWED_LIGHT.
    first    : how many rays a camera ray may become at once, where it hits what is rough.
    sampler  : of the pixels; None: samples are told apart by their numbers alone.
    """

    radiance: Float64
    seen: Float64
    residual: Float64
    stood_for: Float64
    generation: NDArray[np.int16]
    followed: NDArray[np.int64]
    scratch: NDArray[np.int64]
    count: int
    most_rays: int
    budget: ErrorBudget | None
    signatures: Signatures | None
    aovs: dict[str, Float64]
    first: int
    sampler: Sampler | None

    @classmethod
    def zeros(
        cls,
        m: int,
        count: int = 1,
        cutoff: float = 0.0,
        aovs: Iterable[str] = (),
        depth: int = 0,
        first: int = 1,
        sampler: Sampler | None = None,
        signatures: Signatures | None = None,
    ) -> SampleBuffer:
        """Nothing yet.

        cutoff : throughput that each sample may lose.   depth : most bounces, over which that is released.
        aovs   : light passes that are wanted.   first, sampler, signatures : of the class.
        """
        # All sums are rows of one array: large ones are given in pages of 2 MB, five hundred times as few.
        names, n = list(aovs), m * count
        rows = np.zeros((10 + sum(LIGHT_AOVS[name] for name in names), n))
        spent, unlit, scratch, followed = rows[5:9].view(np.int64)
        # The last ones are those of the light passes.
        place = 10 + np.cumsum([LIGHT_AOVS[name] for name in names])
        budget = ErrorBudget.of(cutoff, depth, spent, unlit, scratch)
        return cls(
            radiance=rows[:3],
            seen=rows[3],
            residual=rows[4],
            stood_for=rows[9],
            generation=np.zeros(n, np.int16),
            followed=followed,
            scratch=scratch,
            count=count,
            most_rays=0 if budget is None else max(MOST_RAYS, int(1 / cutoff)) * first,
            budget=budget,
            signatures=signatures,
            aovs={name: rows[end - LIGHT_AOVS[name] : end] for name, end in zip(names, place.tolist(), strict=True)},
            first=first,
            sampler=sampler,
        )

    def next_generation(self, sample: Numbers) -> None:
        """The rays that samples (n,) follow next are one bounce further."""
        self.generation[sample] = self.generation.take(sample) + np.int16(1)

    def add_radiance(self, sample: Numbers, contribution: Float32, branch: NDArray[np.uint8] | None = None) -> None:
        """Add (3, n) to samples (n,), one after the other, in the order of the arrays.

        branch : (rows, n) of the rays (see `Rays`); no rows, or None: no light pass asks.
        """
        add_at(self.radiance, sample, contribution)
        if branch is None or len(branch) == 0:
            return
        for name, numbers in BRANCHES.items():
            if name in self.aovs:
                members = flatnonzero(np.isin(branch[WAY], numbers))
                add_at(self.aovs[name], sample[members], contribution[:, members])
        if "drawn" in self.aovs:
            members = flatnonzero(is_drawn(branch))
            self.add_drawn_light(sample[members], contribution[:, members])

    def add_drawn_light(self, sample: Numbers, light: Float32) -> None:
        """Note light (3, n), which has been added, that came by ways drawn at random."""
        add_at(self.aovs["drawn"], sample, light)

    def add_drawn(self, sample: Numbers, weight: Float32) -> None:
        """Note the weights (3, n) of ways that are drawn at random from here on."""
        add_at(self.aovs["drawn_weight"], sample, weight)

    def add_shadowed(self, sample: Numbers, shadowed: Float32, unshadowed: Float32) -> None:
        """Note light (3, n), which has been added, with its random shadows and without them."""
        add_at(self.aovs["shadowed"], sample, shadowed)
        add_at(self.aovs["unshadowed"], sample, unshadowed)

    def add_backed(self, sample: Numbers, throughput: Float32) -> None:
        """Note throughput (3, n) that raster-backed hits ended: its largest channel."""
        if "raster_backed" in self.aovs:
            add_at(self.aovs["raster_backed"], sample, largest_component(throughput)[None])

    def add_passed(self, sample: Numbers, throughput: Float32) -> None:
        """Note throughput (3, n) by which the background is seen straight through ray traced surfaces."""
        add_at(self.aovs["passed"], sample, throughput)

    def add_residual(self, sample: Numbers, lost: Float32) -> None:
        """Note throughput that was cut off: its largest channel (n,), so that L_max times it bounds the error."""
        add_at(self.residual[None], sample, lost[None])
        if self.budget is not None:
            self.budget.charge(sample, lost)

    def add_seen(self, sample: Numbers, share: Float32 | float = 1.0) -> None:
        """Count samples (n,), or take them back (share (n,) < 0)."""
        np.add.at(self.seen, sample, np.broadcast_to(np.float64(share), sample.shape))

    def cuttable(self, sample: Numbers, weight: Float32) -> NDArray[np.bool_]:
        """Which branches of weight (n,) of samples (n,) the budgets allow to be cut: see `ErrorBudget.cuttable`."""
        if self.budget is None:
            return np.zeros(len(weight), bool)
        return self.budget.cuttable(sample, weight, self.generation)

    def cut_light(self, sample: Numbers, share: Float32) -> Numbers:
        """Which of n samples do without a light that brings them so much, (n,), of what a white wall would send on.

        That is residual then.
        """
        if self.budget is None:
            return np.zeros(0, np.intp)
        cut = self.budget.cut_light(sample, share)
        np.add.at(self.residual, sample.take(cut), share.take(cut).astype(np.float64))
        return cut

    def drawn(self, sample: Numbers, weight: Float32) -> Float64 | None:
        """By what branches of weight (n,) of samples (n,) are to be multiplied, (n,), so that they are not too many.

        0 for those that are not followed: that is residual (see `branch_selection`). None: all are followed, and are
        none too many.
        """
        if self.most_rays == 0 and len(weight) <= MAX_BRANCHES:
            return None
        most_branches = MAX_BRANCHES * self.first
        if follow_all(sample, weight, self.followed, self.scratch, most_branches, self.most_rays, RAYS_AHEAD):
            return None
        # How many branches each sample has, and how many it may follow.
        there = flatnonzero(weight > 0)
        owner = sample.take(there)
        number, most = _room(owner, self.followed, self.scratch, most_branches, self.most_rays, RAYS_AHEAD)
        many = flatnonzero(number > most)
        # Where they are too many, draw; what is left out is residual, which others stand for.
        factor = np.ones(len(weight))
        some, cost = owner[many], budget_units(weight.take(there[many]))
        factor[there[many]] = draw(some, cost, most[many], self._chances(some))
        np.add.at(self.followed, owner[factor[there] > 0], 1)
        left_out = there[factor[there] == 0]
        self.stand_for(sample.take(left_out), weight.take(left_out))
        return factor

    def stand_for(self, sample: Numbers, lost: Float32) -> None:
        """Samples (n,) leave out light of weight (n,) that others stand for: that is residual."""
        for total in (self.residual, self.stood_for):
            np.add.at(total, sample, lost.astype(np.float64))

    def close(self) -> None:
        """All is followed: where others stand for rays, no more than all of the light can be wrong."""
        np.minimum(self.residual, np.maximum(self.residual - self.stood_for, 1.0), out=self.residual)

    def _chances(self, sample: Numbers) -> Float64:
        """A random number (n,) for each sample (n,) and generation, strictly between 0 and 1."""
        unknown = Sampler(np.arange(len(self.seen) // self.count, dtype=np.uint32), 0, self.count)
        way = self.generation.take(sample).astype(np.uint32)
        chance = Draws(self.sampler or unknown, sample, way).square(LOT)[0]
        return np.asarray((chance.astype(np.float64) * (1 - BUDGET_UNIT)) + BUDGET_UNIT / 2)


@accelerated
def add_at(to: Float64, sample: Numbers, values: Float32) -> None:
    """Add (k, n) to columns `sample` (n,) of sums (k, samples), one after the other."""
    for channel, row in zip(to, values.astype(np.float64), strict=True):
        np.add.at(channel, sample, row)  # of the sums' own type: thirty times as fast as with another


@accelerated
def follow_all(
    sample: Numbers, weight: Float32, followed: NDArray[np.int64], scratch: NDArray[np.int64], most: int,
    most_rays: int, ahead: int,
) -> bool:  # fmt: skip
    """Whether no sample has too many branches (n,), those of weight 0 apart; then they are counted in `followed`.

    followed, scratch, most_rays : see `SampleBuffer`.   most, ahead : MAX_BRANCHES for each first ray, RAYS_AHEAD.
    """
    owner = sample.take(flatnonzero(weight > 0))
    number, limit = _room(owner, followed, scratch, most, most_rays, ahead)
    if (number > limit).any():
        return False
    np.add.at(followed, owner, 1)
    return True


def _room(
    owner: Numbers, followed: NDArray[np.int64], scratch: NDArray[np.int64], most: int, most_rays: int, ahead: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """How many branches the sample of each of them (n,) has, and how many it may follow."""
    number = sum_of_each(owner, np.ones(len(owner), np.int64), scratch)
    limit = np.full(len(owner), most)
    if most_rays:
        np.minimum(limit, -(-(most_rays - followed.take(owner)) // ahead), out=limit)
        np.maximum(limit, 1, out=limit)  # the last one goes on for all
    return number, limit
