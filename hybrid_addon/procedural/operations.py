# SPDX-License-Identifier: GPL-3.0-or-later
"""The operations that expressions are made of, by name: those of Blender's nodes of numbers, colours and vectors.

Each takes arrays of 1 (a number) or 3 (a colour) rows, broadcast over the hits: (1 or 3, n). The formulas are those of
Blender's manual for the node of that name, and of EEVEE's shaders where these say more.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import TEXTURES, colors, coordinates, elementary, spectra
from .coordinates import three
from .fresnel import fresnel_dielectric

Array = NDArray[Any]

LUMINANCE = (0.2126, 0.7152, 0.0722)  # of Blender's default working space (EEVEE's node RGB to BW)


def _mix(t: Array, a: Array, b: Array) -> Array:
    result: Array = a + (b - a) * t
    return result


def _ratio(a: Array, b: Array, otherwise: Array) -> Array:
    """a / b where b > 0."""
    return np.where(b > 0, a / np.where(b > 0, b, 1), otherwise)


def _gray(color: Array) -> Array:
    if len(color) == 1:
        return color
    return LUMINANCE[0] * color[0:1] + LUMINANCE[1] * color[1:2] + LUMINANCE[2] * color[2:3]


def _average(color: Array) -> Array:
    return np.asarray(color.mean(axis=0, keepdims=True))


def _join(*rows: Array) -> Array:
    return np.concatenate(np.broadcast_arrays(*(row[:1] for row in rows)))


def _power(a: Array, b: Array) -> Array:
    with np.errstate(all="ignore"):
        return np.nan_to_num(elementary.power(a, b), nan=0.0)


def _facing(cosine: Array, blend: Array) -> Array:
    """Facing of Layer Weight; what has no normal has 0, as in EEVEE."""
    exponent = np.where(blend < 0.5, 2 * blend, 0.5 / np.maximum(1 - blend, 1e-5))
    share = elementary.power(np.clip(np.abs(cosine), 0, 1), np.where(blend == 0.5, 1, exponent))
    return np.asarray(np.nan_to_num(1 - share))


def _cosine_between(normal: Array, direction: Array) -> Array:
    """Of the angle between a normal of any length and a unit direction; NaN where the normal is 0."""
    length = np.sqrt(_dot(normal, normal))
    return np.where(length > 0, _dot(normal, direction) / np.where(length > 0, length, 1), np.nan)


def _fresnel(cosine: Array, ior: Array) -> Array:
    """What has no normal mirrors all light, as in EEVEE."""
    return np.where(np.isnan(cosine), 1, fresnel_dielectric(np.abs(cosine), ior))


def _wrapped(value: Array, high: Array, low: Array) -> Array:
    span = high - low
    return np.where(span != 0, value - span * np.floor((value - low) / np.where(span != 0, span, 1)), low)


def _pingpong(value: Array, scale: Array) -> Array:
    safe = np.where(scale != 0, scale, 1)
    x = (value - safe) / (safe * 2)
    return np.where(scale != 0, np.abs((x - np.floor(x)) * safe * 2 - safe), 0)


def _normalize(v: Array) -> Array:
    length = np.sqrt((v * v).sum(axis=0, keepdims=True))
    return np.asarray(v / np.where(length > 0, length, 1))


def _dot(a: Array, b: Array) -> Array:
    return np.asarray((three(a) * three(b)).sum(axis=0, keepdims=True))


def _cross(a: Array, b: Array) -> Array:
    a, b = three(a), three(b)
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _normal_map(color: Array, strength: Array, tangent: Array, normal: Array) -> Array:
    """Tangent space; a tangent (4, n) has the sign of the bitangent in its last row. The strength tilts, as in EEVEE's
    node_normal_map; tangent and normal are as interpolation leaves them (MikkTSpace), not made unit."""
    x, y, z = 2 * three(color) - 1
    x, y, z = x * strength[0], y * strength[0], _mix(np.clip(strength[0], 0, 1), np.ones_like(z), z)
    bitangent = tangent[3] * _cross(normal, tangent[:3])
    mapped = tangent[:3] * x + bitangent * y + normal * z
    return _normalize(np.where((tangent[:3] != 0).any(axis=0), mapped, normal))


def _bump(gradient: Array, strength: Array, distance: Array, normal: Array) -> Array:
    """Mikkelsen 2010, Bump mapping unparametrized surfaces on the GPU."""
    return _normalize(_mix(np.maximum(strength, 0), normal, _normalize(normal - distance * gradient)))


def _smooth(x: Array) -> Array:
    x = np.clip(x, 0, 1)
    result: Array = x * x * (3 - 2 * x)
    return result


def _smoother(x: Array) -> Array:
    x = np.clip(x, 0, 1)
    result: Array = x * x * x * (x * (x * 6 - 15) + 10)
    return result


OPERATIONS: dict[str, Callable[..., Array]] = {
    "add": lambda a, b: a + b,
    "subtract": lambda a, b: a - b,
    "multiply": lambda a, b: a * b,
    "divide": lambda a, b: np.where(b != 0, a / np.where(b != 0, b, 1), 0),
    "ratio": _ratio,
    "multiply_add": lambda a, b, c: a * b + c,
    "power": _power,
    "root": lambda a: np.sqrt(np.maximum(a, 0)),
    "absolute": np.abs,
    "minimum": np.minimum,
    "maximum": np.maximum,
    "less": lambda a, b: (a < b).astype(np.result_type(a, b)),
    "greater": lambda a, b: (a > b).astype(np.result_type(a, b)),
    "floor": np.floor,
    "ceil": np.ceil,
    "round": lambda a: np.floor(a + 0.5),
    "fraction": lambda a: a - np.floor(a),
    "modulo": lambda a, b: np.where(b != 0, np.fmod(a, np.where(b != 0, b, 1)), 0),
    "sine": elementary.sin,
    "cosine": elementary.cos,
    "clamp": lambda a, low, high: np.minimum(np.maximum(a, low), high),
    "smooth": _smooth,
    "mix": _mix,
    "screen": colors.screen,
    "overlay": colors.overlay,
    "soft_light": colors.soft_light,
    "difference": lambda a, b: np.abs(a - b),
    "gray": _gray,
    "average": _average,
    "join": _join,
    "channel": lambda a, data: a[min(data, len(a) - 1)][None],
    "rows": lambda a, data: a[data[0] : data[1]],
    "held": lambda a: a,
    "blackbody": spectra.blackbody,
    "wavelength": spectra.wavelength,
    "ramp": colors.ramp,
    "curves": colors.curves,
    "curves_beyond": colors.curves_beyond,
    "rgb_to_hsv": colors.rgb_to_hsv,
    "hsv_to_rgb": colors.hsv_to_rgb,
    "hue_saturation": colors.hue_saturation,
    "affine": coordinates.affine,
    "mapping": coordinates.mapping,
    "transformed": coordinates.transformed,
    "turned": coordinates.turned,
    "turned_about": coordinates.turned_about,
    "gamma": lambda a, b: np.where(a > 0, _power(np.where(a > 0, a, 1), b), a),
    "exclusion": lambda a, b: np.maximum(a + b - 2 * a * b, 0),
    "dodge": colors.dodge,
    "burn": colors.burn,
    "smoother": _smoother,
    "first_three": lambda a: a[:3],
    "facing": _facing,
    "wrap": lambda a, b: _wrapped(a, b, np.zeros_like(b)),
    "wrap_between": _wrapped,
    "pingpong": _pingpong,
    "snap": lambda a, b: np.where(b != 0, np.floor(a / np.where(b != 0, b, 1)) * b, 0),
    "compare": lambda a, b, c: (np.abs(a - b) <= np.maximum(c, 1e-5)).astype(np.result_type(a, b)),
    "radians": np.radians,
    "degrees": np.degrees,
    "inverse_root": lambda a: np.where(a > 0, 1 / np.sqrt(np.where(a > 0, a, 1)), 0),
    "wrap_sphere": coordinates.wrap_sphere,
    "wrap_tube": coordinates.wrap_tube,
    "equirect": coordinates.equirect,
    "mirror_ball": coordinates.mirror_ball,
    "box_view": coordinates.box_view,
    "box_weights": coordinates.box_weights,
    "dot": _dot,
    "cross": _cross,
    "length": lambda a: np.sqrt(_dot(a, a)),
    "normalize": _normalize,
    "normal_map": _normal_map,
    "bump": _bump,
    "cosine_between": _cosine_between,
    "fresnel": _fresnel,
    "tangent": elementary.tan,
    "arctangent": elementary.arctan,
    "arctangent2": elementary.arctan2,
    "arcsine": lambda a: elementary.arcsin(np.clip(a, -1, 1)),
    "arccosine": lambda a: elementary.arccos(np.clip(a, -1, 1)),
    "exponent": elementary.exp,
    "logarithm": lambda a, b: np.where(
        (a > 0) & (b > 0), elementary.log(np.maximum(a, 1e-38)) / elementary.log(np.maximum(b, 1e-38)), 0
    ),
    "sign": np.sign,
    "truncate": np.trunc,
    **TEXTURES,
}
"""Operations on the values of their inputs, and on `data` as a last argument if there is some."""
