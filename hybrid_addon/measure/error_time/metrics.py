# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a picture is from a reference: linear radiance, float64, over a region of pixels."""

from __future__ import annotations

import hashlib
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

RELATIVE_FLOOR = 0.01
"""Added to the squared reference in relMSE, so that black has a relative error too. tev's value (tev, Colors.h)."""


def error(picture: Picture, reference: Picture, region: Bools) -> dict[str, float | int | None]:
    """Errors of a picture (h, w, 3) over the pixels of a region (h, w); each channel counts as a value.

    rmse_shown: of what is shown, both clipped to 0..1. rmse, mae, bias (mean signed), p999 (99.9th percentile of the
    absolute error), max: in the unit of the picture. relmse_tev: mean of d^2 / (reference^2 + 0.01), dimensionless. All
    None for an empty region. Values that are not finite are counted and left out of the others.
    """
    d = picture[region].astype(np.float64) - reference[region]
    finite = np.isfinite(d)
    seen = (shown(picture[region]) - shown(reference[region]))[finite]
    result: dict[str, float | int | None] = {
        "pixels": int(np.count_nonzero(region)),
        "nonfinite": int(np.count_nonzero(~finite)),
    }
    relative = np.square(d) / (np.square(reference[region].astype(np.float64)) + RELATIVE_FLOOR)
    d, relative = d[finite], relative[finite]
    size = np.abs(d)
    if len(d) == 0:
        return {**result, **dict.fromkeys((SHOWN, "rmse", "mae", "bias", "relmse_tev", "p999", "max"))}
    return {
        **result,
        SHOWN: float(np.sqrt(np.mean(seen * seen))),
        "rmse": float(np.sqrt(np.mean(d * d))),
        "mae": float(size.mean()),
        "bias": float(d.mean()),
        "relmse_tev": float(relative.mean()),
        "p999": float(np.percentile(size, 99.9)),
        "max": float(size.max()),
    }


def errors(
    picture: Picture, reference: Picture, regions: Mapping[str, Bools]
) -> dict[str, dict[str, float | int | None]]:
    """`error` of each region, and flip_ldr, the mean there of `flip`; None without the library."""
    differences = flip(picture, reference)
    found = {}
    for name, region in regions.items():
        found[name] = error(picture, reference, region)
        known = None if differences is None or not region.any() else differences[region]
        found[name]["flip_ldr"] = None if known is None else float(known.mean(dtype=np.float64))
    return found


def shown(picture: Picture) -> Float64:
    """Radiance as a screen can show it."""
    return np.asarray(np.clip(picture, 0.0, 1.0), np.float64)


def deciding(picture: Picture, reference: Picture, region: Bools) -> float:
    """How many pixels decide the RMSE of what is shown: (sum of squares)^2 / sum of fourth powers; 0: no error.

    All of them where all err alike. The RMSE is only known to about 1 / (2 sqrt(this)) of itself.
    """
    d = shown(picture[region]) - shown(reference[region])
    squares = np.square(np.where(np.isfinite(d), d, 0.0)).sum(axis=-1)
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
