# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a picture is from a reference: linear radiance, float64, over a region of pixels."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32, Float64

Bools = NDArray[np.bool_]
Picture = Float32 | Float64

SHOWN = "rmse_shown"
"""The error that everything is judged and plotted by, beside FLIP: of radiance clipped to 0..1, as a screen shows it.
Of a lamp's image at 1000 a pixel's edge is worth more than all the rest of a picture, and nobody sees it."""

LEAST = "rmse_shown_least"
"""The least `SHOWN` that could be told from none."""

CLEAR = 3.0
"""Standard errors: a mean squared error that is smaller cannot be told from none."""

BLOCK = 8
"""Pixels across and up: blocks so much wider than the pixel filter err independently of each other, pixels do not."""

RELATIVE_FLOOR = 0.01
"""Added to the squared reference in relMSE, so that black has a relative error too. tev's value (tev, Colors.h)."""


def error(picture: Picture, reference: Picture, region: Bools) -> dict[str, float | int | None]:
    """Errors of a picture (h, w, 3) over the pixels of a region (h, w); each channel counts as a value.

    rmse, mae, bias (mean signed), p999 (99.9th percentile of the absolute error), max: in the unit of the picture.
    relmse_tev: mean of d^2 / (reference^2 + 0.01), dimensionless. All None for an empty region. Values that are not
    finite are counted and left out of the others. (`judged` has the error of what is shown, in which they count.)
    """
    d = picture[region].astype(np.float64) - reference[region]
    finite = np.isfinite(d)
    result: dict[str, float | int | None] = {
        "pixels": int(np.count_nonzero(region)),
        "nonfinite": int(np.count_nonzero(~finite)),
    }
    relative = np.square(d) / (np.square(reference[region].astype(np.float64)) + RELATIVE_FLOOR)
    d, relative = d[finite], relative[finite]
    size = np.abs(d)
    if len(d) == 0:
        return {**result, **dict.fromkeys(("rmse", "mae", "bias", "relmse_tev", "p999", "max"))}
    return {
        **result,
        "rmse": float(np.sqrt(np.mean(d * d))),
        "mae": float(size.mean()),
        "bias": float(d.mean()),
        "relmse_tev": float(relative.mean()),
        "p999": float(np.percentile(size, 99.9)),
        "max": float(size.max()),
    }


def errors(
    picture: Picture, reference: Picture, regions: Mapping[str, Bools], halves: tuple[Picture, Picture] | None = None
) -> dict[str, dict[str, float | int | None]]:
    """`error` of each region, and what `judged` says of `maps`: SHOWN without the halves' noise, if they are given."""
    differences = maps(picture, reference, halves)
    return {name: error(picture, reference, part) | judged(differences, part) for name, part in regions.items()}


def maps(picture: Picture, reference: Picture, halves: tuple[Picture, Picture] | None = None) -> dict[str, Float64]:
    """The errors of single pixels (h, w): `squares`, and flip_ldr where the library is."""
    found = {SHOWN: squares(picture, reference, halves)}
    differences = flip(picture, reference)
    return found if differences is None else {**found, "flip_ldr": differences.astype(np.float64)}


def squares(picture: Picture, reference: Picture, halves: tuple[Picture, Picture] | None = None) -> Float64:
    """SHOWN squared of single pixels (h, w), mean of the channels.

    halves : two independent pictures (h, w, 3), a and b, whose mean the reference is. With them SHOWN is (p - a)(p - b)
    of what is shown, instead of the square of p - reference. Its expectation has no noise of a or b in it, since they
    are independent, where the square has their variance, too. So a single pixel may be negative. A value that is not a
    number is as wrong as can be: 1.
    """
    a, b = (shown(half) for half in halves or (reference, reference))
    p = shown(picture)
    return np.asarray(np.nan_to_num((p - a) * (p - b), nan=1.0).mean(axis=-1))


def judged(found: Mapping[str, Float64], region: Bools) -> dict[str, float | int | None]:
    """SHOWN, LEAST and flip_ldr over the pixels of a region (h, w), by the maps; None where there is none."""
    values: dict[str, float | int | None] = dict.fromkeys((SHOWN, LEAST, "flip_ldr"))
    n = int(np.count_nonzero(region))
    if n == 0:
        return values
    mean = float(found[SHOWN][region].mean())
    spread = in_blocks(np.where(region, found[SHOWN] - mean, 0.0))
    values[SHOWN] = math.sqrt(max(mean, 0.0))
    values[LEAST] = math.sqrt(CLEAR * math.sqrt(float(np.square(spread).sum())) / n)
    if "flip_ldr" in found:
        values["flip_ldr"] = float(found["flip_ldr"][region].mean())
    return values


def tells(errors: Mapping[str, float | int | None]) -> bool:
    """Whether the SHOWN of a region can be told from none."""
    error, least = errors[SHOWN], errors[LEAST]
    return error is not None and least is not None and error > least


def in_blocks(values: Float64) -> Float64:
    """The sums (k,) of an image (h, w) over blocks of BLOCK x BLOCK pixels."""
    rows, columns = (np.arange(0, size, BLOCK) for size in values.shape)
    return np.asarray(np.add.reduceat(np.add.reduceat(values, rows, axis=0), columns, axis=1).ravel(), np.float64)


def doubt(ours: Float64, theirs: Float64) -> float:
    """Standard error of the logarithm of the ratio of two sums over the same independent blocks (k,).

    What both have in common, as the reference's noise, cancels. Infinite where a sum is not positive.
    """
    if min(ours.sum(), theirs.sum()) <= 0:
        return math.inf
    return float(np.sqrt(np.square(ours / ours.sum() - theirs / theirs.sum()).sum()))


def shown(picture: Picture) -> Float64:
    """Radiance as a screen can show it."""
    return np.asarray(np.clip(picture, 0.0, 1.0), np.float64)


def deciding(picture: Picture, reference: Picture, region: Bools) -> float:
    """How many pixels decide the RMSE of what is shown: (sum of squares)^2 / sum of fourth powers; 0: no error.

    All of them where all err alike. The RMSE is only known to about 1 / (2 sqrt(this)) of itself.
    """
    d = shown(picture[region]) - shown(reference[region])
    squares = np.nan_to_num(np.square(d), nan=1.0).sum(axis=-1)
    fourth = float(np.square(squares).sum())
    return float(squares.sum()) ** 2 / fourth if fourth else 0.0


def rmse(picture: Picture, reference: Picture, region: Bools) -> float:
    """That number of `error`; NaN for an empty region."""
    value = error(picture, reference, region)["rmse"]
    return float("nan") if value is None else float(value)


def digest(picture: Picture) -> str:
    """Sixteen hexadecimal digits that tell this picture, in single precision, from others."""
    return hashlib.sha256(np.ascontiguousarray(picture, np.float32).tobytes()).hexdigest()[:16]


def flip_library() -> ModuleType | None:
    """NVIDIA's flip-evaluator, where it is installed."""
    try:
        import flip_evaluator
    except ImportError:
        return None
    result: ModuleType | None = flip_evaluator
    return result


def flip(picture: Picture, reference: Picture) -> Float32 | None:
    """FLIP's difference map (h, w), 0..1, as seen at 67 pixels a degree; None without the library.

    Low dynamic range: both are clipped to 0..1 and shown through the sRGB curve. Values that are not finite would pass
    unseen (FLIP answers .0007 for NaN): they count as white against the reference's black, or the other way round.
    """
    library = flip_library()
    if library is None:
        return None
    shown = np.where(np.isfinite(picture), picture, np.where(reference > 0.5, 0.0, 1.0))
    images = [np.ascontiguousarray(np.clip(image, 0, 1), np.float32) for image in (reference, shown)]
    found = library.evaluate(*images, "LDR", inputsRGB=False, applyMagma=False, computeMeanError=False)[0]
    return np.asarray(found, np.float32).reshape(reference.shape[:2])
