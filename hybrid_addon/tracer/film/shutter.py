# SPDX-License-Identifier: GPL-3.0-or-later
"""One picture of several: what the film sees while the shutter is open, moment by moment.

Coverage and covered light add up, and are divided only in the end: a pixel that an object is in for a third of the time
has a third of its coverage, and the object's own colour.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...scene import Film, Float32
from .filter import fill_from_neighbours
from .samples import LIGHT_AOVS

COUNTED = {"samples"}
"""Passes that add up as numbers do; the light passes weigh as light does, and what else there is (depth, normals) is
that of the moment in the middle."""


class OpenShutter:
    """Adds up films of one window, each of a moment, traced with `Settings.fill` off.

    Only sums are kept, so a moment's film may be let go of once it is added.
    """

    def __init__(self) -> None:
        self._films = 0
        self._weight = 0.0
        self._light: dict[str, Float32] = {}
        self._coverage: Float32 | None = None
        self._rest: dict[str, Float32] = {}
        self._middle: dict[str, Any] = {}
        self._memory: dict[str, Any] = {}
        self._still: dict[str, Float32] = {}
        self._counts: dict[str, Counter[str]] = {name: Counter() for name in ("rays", "invariants", "hits")}
        self._time: dict[str, Counter[str]] = {}
        self._skipped: Counter[tuple[str, str]] = Counter()
        self._square: float | None = 0.0
        self._samples = Counter[str]()
        self._ended = Counter[str]()
        self._ended_at = Counter[int]()

    def add(self, film: Film, weight: float, middle: bool = False) -> None:
        """Add a moment that lasts as long as `weight` says. middle: its depth and normals are the picture's."""
        self._films += 1
        self._weight += weight
        self._add_pictures(film, weight)
        if self._films == 1 or middle:
            least = film.ended.get("least", 0.0)
            self._middle = {"plan": film.plan, "sampling": film.sampling, "least": least}
            self._still = {n: a for n, a in film.passes.items() if n not in LIGHT_AOVS.keys() | COUNTED}
        for name, counter in self._counts.items():
            counter.update(getattr(film, name))
        for phase, seconds in film.time.items():
            self._time.setdefault(phase, Counter()).update(seconds)
        for entry in film.skipped:
            self._skipped[str(entry["what"]), str(entry["why"])] += int(entry["count"])  # type: ignore[call-overload]
        self._add_estimates(film, weight)
        self._memory = _larger(self._memory, film.memory)

    def _add_pictures(self, film: Film, weight: float) -> None:
        share = film.coverage * np.float32(weight)
        self._coverage = share if self._coverage is None else self._coverage + share
        light = {"radiance": film.radiance, "residual": film.residual}
        light |= {name: film.passes[name] for name in film.passes.keys() & LIGHT_AOVS.keys()}
        for name, values in light.items():
            covered = (values.T * share.T).T
            self._light[name] = covered if name not in self._light else self._light[name] + covered
        rest = {"shadow": film.shadow, "caustic": film.caustic}
        for key, picture in rest.items():
            if picture is not None:
                seen = picture * np.float32(weight)
                self._rest[key] = seen if key not in self._rest else self._rest[key] + seen
        for key in film.passes.keys() & COUNTED:
            self._rest[key] = film.passes[key] if key not in self._rest else self._rest[key] + film.passes[key]

    def _add_estimates(self, film: Film, weight: float) -> None:
        sampling: dict[str, Any] = film.sampling
        ended: dict[str, Any] = film.ended
        rmse = sampling.get("rmse")
        self._square = None if rmse is None or self._square is None else self._square + (weight * rmse) ** 2
        self._samples.update({name: sampling.get(name, 0) for name in ("samples_mean", "samples_max")})
        self._ended.update({name: ended.get(name, 0.0) for name in ("share", "lost", "around", "cutoff")})
        self._ended_at.update(ended.get("objects", {}))

    def result(self, wanted: NDArray[np.bool_] | None, only_ray_traced: bool) -> Film:
        """The picture.

        wanted : (height, width) bool, pixels that get a colour even where no moment had one: the nearest's. None: all.
        only_ray_traced : `Settings.camera_sees` is "RAY_TRACED".
        """
        assert self._coverage is not None
        middle, coverage, n = self._middle, self._coverage, self._films
        found = coverage > 0
        over = np.where(found, coverage, 1)
        light = {name: (values.T / over.T).T.astype(np.float32) for name, values in self._light.items()}
        if only_ray_traced:
            images = tuple(light.values())
            filled = fill_from_neighbours(images, found, np.ones_like(found) if wanted is None else wanted)
            self._skipped["pixels without a sample", "copied from the nearest traced pixel"] += filled
        rest = {key: (a if key in COUNTED else a / np.float32(self._weight)) for key, a in self._rest.items()}
        passes = {**self._still, **{k: light[k] for k in light.keys() & LIGHT_AOVS.keys()}}
        passes |= {key: rest[key] for key in rest.keys() & COUNTED}
        ended = {name: total / n for name, total in self._ended.items()} | {"objects": dict(self._ended_at)}
        rmse = None if self._square is None else math.sqrt(self._square) / self._weight
        return Film(
            radiance=light["radiance"],
            coverage=coverage / np.float32(self._weight),
            residual=light["residual"],
            rays=dict(self._counts["rays"]),
            time={phase: dict(seconds) for phase, seconds in self._time.items()},
            invariants=dict(self._counts["invariants"]),
            skipped=[{"what": w, "why": why, "count": k} for (w, why), k in self._skipped.items() if k],
            sampling={**middle["sampling"], **self._samples, "rmse": rmse},
            plan=middle["plan"],
            passes=dict(sorted(passes.items())),
            shadow=rest.get("shadow"),
            caustic=rest.get("caustic"),
            hits=dict(self._counts["hits"]),
            ended={"least": middle["least"], **ended},
            memory=self._memory,
        )


def _larger(one: dict[str, Any], other: dict[str, Any]) -> dict[str, Any]:
    """Of each entry of `Film.memory` the larger: moments are traced one after the other."""
    if not one or not other:
        return one or other
    result: dict[str, Any] = {}
    for key, value in one.items():
        if isinstance(value, dict):
            names = {**value, **other[key]}
            both = {name: max(value.get(name, 0), other[key].get(name, 0)) for name in names}
            result[key] = dict(sorted(both.items(), key=lambda entry: -entry[1]))
        else:
            result[key] = other[key] if value is None else max(value, other[key] or 0)
    return result
