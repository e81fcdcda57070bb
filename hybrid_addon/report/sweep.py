"""Error against run time of one scene: the same picture at many settings, against a deep reference of our own.

Each knob alone, the others at the reference's level and with the same camera samples, so that its error is its own;
then the combinations that can be worth their time, one after the other and round again, so that a slow minute of the
machine hits all of them.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from statistics import median
from typing import Any

import numpy as np

from ..presets import QUALITY, Quality
from ..scene import Expression, Film, Float32, Float64, Scene, Settings
from ..tracer import CompiledScene, trace_compiled
from ..tracer.constants import FIRST_SAMPLES, SAMPLING_SLOPE
from ..tracer.sky import brightest
from ..tracer.validate import validate
from . import fits, metrics
from .metrics import Bools
from .regions import object_ids, regions

Say = Callable[[str], None]

PATIENCE = 5.0
"""Seconds; what takes longer is timed once."""

BRIGHTER = 2.0
"""What a cut ray would have met is taken to be at most so many times as bright as the brightest pixel, or as the world
and what emits if these are brighter: an estimate, since a highlight may be brighter still."""

REFERENCE_CUTOFF = 5e-5
"""The reference follows what brings more than this: below what its samples resolve. Without a cutoff the paths between
mirrors and half clear glass multiply with every bounce."""

LEAST_REFERENCE = 16
"""Samples that it has however long they take."""

REFERENCE_SEEDS = (101, 202)
"""The reference's camera samples are none that a render uses, or a render would be compared with itself."""


@dataclass(frozen=True)
class Axes:
    """The settings to combine, and how deep the reference is.

    repeats : timed runs of each.   reference_seconds : the reference takes fewer samples if these would not do; nothing
    that would take twice as long is measured.
    """

    samples: tuple[int, ...] = (1, 4, 16, 64)
    max_depth: tuple[int, ...] = (1, 2, 4, 8, 16, 32)
    cutoff: tuple[float, ...] = (1e-3, 1 / 255, 1 / 64)
    adaptive: tuple[float, ...] = (0.0, 0.05)
    reference_samples: int = 256
    reference_seconds: float = 120.0
    repeats: int = 3

    @property
    def deepest(self) -> int:
        """The reference's bounces: twice the largest asked for."""
        return 2 * max(*self.max_depth, 1)

    @property
    def knob_samples(self) -> int:
        """Samples at which bounces and cutoff are varied: few, they cancel out."""
        return max([s for s in self.samples if s <= FIRST_SAMPLES] or [min(self.samples)])

    def deep(self, samples: int) -> Quality:
        """These samples with as good as nothing cut off."""
        return Quality(samples, self.deepest, REFERENCE_CUTOFF, 0.0)


@dataclass
class Point:
    """One combination: its times, its errors by region, and what was cut off."""

    quality: Quality
    preset: str = ""
    films: list[dict[str, Any]] = field(default_factory=list)
    error: dict[str, dict[str, Any]] = field(default_factory=dict)
    bound: dict[str, float] = field(default_factory=dict)
    rays: dict[str, int] = field(default_factory=dict)
    sampling: dict[str, Any] = field(default_factory=dict)
    invariants: dict[str, int] = field(default_factory=dict)

    @property
    def rmse(self) -> float:
        """Over all masked pixels."""
        value = self.error["all"]["rmse"]
        return float("nan") if value is None else float(value)

    def seconds(self, phase: str = "trace", clock: str = "wall") -> float:
        """Median of a phase."""
        return median(times[phase][clock] for times in self.films)

    def as_dict(self, base: float) -> dict[str, Any]:
        """For JSON. base: seconds that every render spends before it traces."""
        phases = self.films[0]
        time = {
            phase: {
                "wall_med": self.seconds(phase),
                "wall_min": min(times[phase]["wall"] for times in self.films),
                "cpu_med": self.seconds(phase, "cpu"),
                "n": len(self.films),
            }
            for phase in phases
        }
        return {
            "settings": self.quality.values(), "preset": self.preset, "seconds": base + self.seconds(), "time": time,
            "rays": self.rays, "error": self.error, "bound": self.bound, "sampling": self.sampling,
            "invariants": self.invariants,
        }  # fmt: skip


class Studio:
    """A scene made ready once, and pictures of it at any quality, as they show in the composite.

    mask : (h, w), coverage of the ray traced objects in EEVEE's picture, or None: the tracer draws every pixel.
    """

    def __init__(self, scene: Scene, settings: Settings, mask: Float32 | None) -> None:
        validate(scene, settings, mask)
        self.scene, self.mask = scene, mask
        wall, cpu = time.perf_counter(), time.process_time()
        self._compiled = CompiledScene(scene, settings)
        self.build = {"wall": time.perf_counter() - wall, "cpu": time.process_time() - cpu}
        self.ids = object_ids(self._compiled)

    def trace(self, quality: Quality, seed: int = 0) -> Film:
        """A film at this quality."""
        values: dict[str, Any] = {**quality.values(), "seed": seed}
        settings = replace(self._compiled.settings, **values)
        return trace_compiled(self._compiled.seen_from(self._compiled.camera, settings), self.mask)

    def shown(self, film: Film) -> Float32:
        """Its radiance (h, w, 3) times coverage: what it adds to the composite."""
        return np.asarray(film.radiance * self.weight(film)[..., None], np.float32)

    def brightest(self, film: Film) -> float:
        """An estimate of the largest radiance along any ray."""
        scene = self.scene
        constant = [s.emission for s in scene.surfaces if not isinstance(s.emission, Expression)]
        emission = max(map(max, constant), default=0.0)
        return max(BRIGHTER * float(np.max(film.radiance, initial=0.0)), brightest(scene.world), emission)

    def weight(self, film: Film) -> Float32:
        """Coverage (h, w)."""
        return film.coverage if self.mask is None else self.mask


@dataclass(eq=False)
class Reference:
    """The mean of two independent deep pictures.

    floor : how far it is itself from the truth, RMSE by region.   each : seconds for one sample of so deep a picture.
    """

    picture: Float64
    film: Film
    regions: dict[str, Bools]
    floor: dict[str, float]
    quality: Quality
    seconds: float
    each: float


def reference(studio: Studio, axes: Axes) -> Reference:
    """Twice half the samples. The halves' RMSE, halved, is the standard error of their mean."""
    began = time.perf_counter()
    each = studio.trace(axes.deep(1)).time["trace"]["wall"]
    samples = min(axes.reference_samples, max(LEAST_REFERENCE, axes.reference_seconds / max(each, 1e-9)))
    quality = axes.deep(max(1, int(samples) // 2))
    films = [studio.trace(quality, seed) for seed in REFERENCE_SEEDS]
    a, b = (studio.shown(film).astype(np.float64) for film in films)
    found = regions(studio.ids, studio.weight(films[0]))
    floor = {name: metrics.rmse(a, b, region) / 2 for name, region in found.items()}
    quality = replace(quality, samples=2 * quality.samples)
    return Reference((a + b) / 2, films[0], found, floor, quality, time.perf_counter() - began, each)


# ------------------------------------------------------------------------------------------------ one knob alone


def knobs(studio: Studio, axes: Axes, deep: Reference, say: Say) -> dict[str, Any]:
    """Error of bounces and cutoff, alone and together, against the same camera samples without them.

    Each entry: settings, seconds, rmse over all pixels, residual_mean and residual_max, and `beyond`: pixels whose
    error is larger than residual x `Lmax`.
    """
    exact = axes.deep(axes.knob_samples)
    whole = studio.trace(exact)
    target, region = studio.shown(whole), deep.regions["all"]
    brightest = studio.brightest(whole)
    entries = []
    for cutoff, max_depth in product((REFERENCE_CUTOFF, *axes.cutoff), (*axes.max_depth, axes.deepest)):
        say(f"bounces {max_depth}, cutoff {cutoff:.2g}")
        film = studio.trace(replace(exact, max_depth=max_depth, cutoff=cutoff))
        bound = film.residual * studio.weight(film)
        off = np.abs(studio.shown(film).astype(np.float64) - target).max(axis=-1)
        rounding = 1e-6 * brightest
        entries.append({
            "max_depth": max_depth, "cutoff": cutoff, "seconds": film.time["trace"]["wall"],
            "rmse": metrics.rmse(studio.shown(film), target, region),
            "residual_mean": _mean(bound[region]), "residual_max": float(np.max(bound[region], initial=0.0)),
            "beyond": int(np.count_nonzero(off[region] > bound[region] * brightest + rounding)),
        })  # fmt: skip
    return {"samples": exact.samples, "Lmax": brightest, "entries": entries}


def promising(entries: Sequence[dict[str, Any]], at_most: int = 4) -> list[tuple[int, float]]:
    """The (max_depth, cutoff) that no other beats, evenly chosen from the cheapest to the most exact."""
    front = fits.pareto([e["seconds"] for e in entries], [e["rmse"] for e in entries])
    chosen = np.unique(np.linspace(0, len(front) - 1, min(at_most, len(front))).round().astype(int))
    return [(entries[front[i]]["max_depth"], entries[front[i]]["cutoff"]) for i in chosen]


# ------------------------------------------------------------------------------------------------ combinations


def combinations(axes: Axes, pairs: Iterable[tuple[int, float]]) -> list[Point]:
    """What to time: samples alone with nothing cut, the promising combinations, and the presets; each once."""
    qualities = [axes.deep(samples) for samples in axes.samples]
    for (max_depth, cutoff), samples, adaptive in product(pairs, axes.samples, axes.adaptive):
        if adaptive == 0 or samples > FIRST_SAMPLES:
            qualities.append(Quality(samples, max_depth, cutoff, adaptive))
    named = {quality: label for label, _, quality in QUALITY.values()}
    return [Point(quality, named.get(quality, "")) for quality in dict.fromkeys([*qualities, *named])]


def affordable(
    points: Iterable[Point], single: dict[str, Any], deep: Reference, axes: Axes
) -> tuple[list[Point], list[Point]]:
    """Those that can be timed, and those that would take too long, as far as what `knobs` found tells."""
    found: tuple[list[Point], list[Point]] = ([], [])
    for point in points:
        q = point.quality
        more = [e["seconds"] for e in single["entries"] if e["max_depth"] >= q.max_depth and e["cutoff"] <= q.cutoff]
        each = min(more, default=deep.each * single["samples"]) / single["samples"]
        found[q.samples * each > 2 * axes.reference_seconds].append(point)
    return found


def measure(studio: Studio, points: Sequence[Point], deep: Reference, repeats: int, say: Say) -> None:
    """Fill in all points, in turn, `repeats` times."""
    for lap in range(repeats):
        for number, point in enumerate(points, 1):
            if lap and point.films[0]["trace"]["wall"] > PATIENCE:
                continue
            film = studio.trace(point.quality)
            point.films.append(film.time)
            if lap == 0:
                _judge(studio, point, film, deep)
                seconds = film.time["trace"]["wall"]
                say(f"{number}/{len(points)} {describe(point.quality)}: {seconds:.2f} s, RMSE {point.rmse:.2g}")


def describe(q: Quality) -> str:
    """In words."""
    return f"samples {q.samples}, bounces {q.max_depth}, cutoff {q.cutoff:.2g}, adaptive {q.adaptive:g}"


def _judge(studio: Studio, point: Point, film: Film, deep: Reference) -> None:
    picture, region = studio.shown(film), deep.regions["all"]
    differences = metrics.flip(picture, deep.picture)
    for name, part in deep.regions.items():
        point.error[name] = metrics.error(picture, deep.picture, part)
        point.error[name]["flip_ldr"] = None if differences is None or not part.any() else _mean(differences[part])
    bound = (film.residual * studio.weight(film))[region]
    point.bound = {"residual_mean": _mean(bound), "residual_max": float(np.max(bound, initial=0.0))}
    point.rays, point.sampling, point.invariants = dict(film.rays), dict(film.sampling), dict(film.invariants)


def slopes(
    points: Sequence[Point], deep: Reference, single: dict[str, Any], axes: Axes
) -> dict[str, fits.Slope | None]:
    """How the error falls with each knob, beside what is expected of it.

    aa_*: exponent of RMSE over samples; stratified samples of edges have -0.75 (Mitchell 1996). Points nearer than
    three times the floor are left out. depth: decades a bounce; expected is the residual's own, which the error must
    not fall slower than. cutoff: exponent of RMSE over cutoff; its bound is a straight line, exponent 1.
    """
    alone = [p for p in points if p.quality == axes.deep(p.quality.samples)]
    found = {}
    for region, floor in deep.floor.items():
        clear = [p for p in alone if (p.error[region]["rmse"] or 0) > 3 * floor]
        errors = [p.error[region]["rmse"] for p in clear]
        found[f"aa_{region}"] = fits.power([p.quality.samples for p in clear], errors, SAMPLING_SLOPE)
    deeper = [e for e in single["entries"] if e["cutoff"] == REFERENCE_CUTOFF]
    residual = fits.decay([e["max_depth"] for e in deeper], [e["residual_mean"] for e in deeper])
    bounces, errors = [e["max_depth"] for e in deeper], [e["rmse"] for e in deeper]
    found["depth"] = fits.decay(bounces, errors, residual.fit if residual else None)
    cut = [e for e in single["entries"] if e["max_depth"] == axes.deepest]
    found["cutoff"] = fits.power([e["cutoff"] for e in cut], [e["rmse"] for e in cut], 1.0)
    return found


def _mean(values: Float32) -> float:
    return float(values.mean(dtype=np.float64)) if values.size else 0.0
