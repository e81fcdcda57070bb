# SPDX-License-Identifier: GPL-3.0-or-later
"""Expressions: numbers and colours that vary over a surface, and the operations that they are made of.

Pure, and shared by the translator, which folds what is constant, and the tracer, which works out the rest at hits.
Every operation takes arrays of 1 (a number) or 3 (a colour) rows, broadcast over the hits: (1 or 3, n). The formulas
are those of Blender's manual for the node of that name.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import fields
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .procedural import TEXTURES, colors, coordinates
from .procedural.coordinates import three
from .procedural.fresnel import fresnel_dielectric
from .scene import Color, Expression, Number, Surface, Texture, Value

Array = NDArray[Any]

LUMINANCE = (0.2126, 0.7152, 0.0722)  # of Blender's default working space (EEVEE's node RGB to BW)
ATTRIBUTE_WIDTHS = {"uv": 2, "color": 4, "generated": 3, "object": 3, "object_normal": 3, "tangent": 4, "around": 4}
"""Numbers of a mesh's corner, by the first word of an attribute's key; other attributes the hits themselves know."""

FINITE = 1e30  # results are clamped to +- this: a division by 0 in a node must not end as NaN in a picture


class Hits(Protocol):
    """What an expression may ask of n hits."""

    def image(self, texture: Texture, uv: Array | None) -> Array:
        """RGBA (4, n) at texture coordinates (2 or 3, n), or at the texture's own UV map for None."""

    def attribute(self, key: str) -> Array:
        """(width, n): "position", "normal" (on the side of the eye), "interpolated_normal" (the same, as long as
        interpolation between the corners leaves it), "true_normal" (of the flat face, on that side), "incoming",
        "backfacing" or "cosine" (of the view angle) of the hits, or interpolated data of the mesh's corners; 0 where
        the mesh has none."""

    def gradient(self, value: Callable[[Any], Array]) -> Array:
        """(3, n): how a number grows along the surface, for each metre, less than 0 seen from the inner side; `value`
        works it out at given hits."""


# ------------------------------------------------------------------------------------------------ operations


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
        return np.nan_to_num(np.power(a, b), nan=0.0)


def _facing(cosine: Array, blend: Array) -> Array:
    """Facing of Layer Weight."""
    exponent = np.where(blend < 0.5, 2 * blend, 0.5 / np.maximum(1 - blend, 1e-5))
    share = np.power(np.clip(np.abs(cosine), 0, 1), np.where(blend == 0.5, 1, exponent))
    return 1 - share


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
    "sine": np.sin,
    "cosine": np.cos,
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
    "ramp": colors.ramp,
    "curves": colors.curves,
    "rgb_to_hsv": colors.rgb_to_hsv,
    "hsv_to_rgb": colors.hsv_to_rgb,
    "hue_saturation": colors.hue_saturation,
    "affine": coordinates.affine,
    "mapping": coordinates.mapping,
    "turned": coordinates.turned,
    "turned_about": coordinates.turned_about,
    "gamma": lambda a, b: np.where(a > 0, _power(np.where(a > 0, a, 1), b), a),
    "exclusion": lambda a, b: np.maximum(a + b - 2 * a * b, 0),
    "dodge": colors.dodge,
    "burn": colors.burn,
    "smoother": lambda x: np.clip(x, 0, 1) ** 3 * (np.clip(x, 0, 1) * (np.clip(x, 0, 1) * 6 - 15) + 10),
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
    "fresnel": lambda cosine, ior: fresnel_dielectric(np.abs(cosine), ior),
    "tangent": np.tan,
    "arctangent": np.arctan,
    "arctangent2": np.arctan2,
    "arcsine": lambda a: np.arcsin(np.clip(a, -1, 1)),
    "arccosine": lambda a: np.arccos(np.clip(a, -1, 1)),
    "exponent": np.exp,
    "logarithm": lambda a, b: np.where(
        (a > 0) & (b > 0), np.log(np.maximum(a, 1e-38)) / np.log(np.maximum(b, 1e-38)), 0
    ),
    "sign": np.sign,
    "truncate": np.trunc,
    **TEXTURES,
}
"""Operations on the values of their inputs, and on `data` as a last argument if there is some."""

ASKING = ("image", "image_alpha", "attribute", "slope")  # operations that ask the hits


# ------------------------------------------------------------------------------------------------ building and folding


def apply(operation: str, *inputs: Value, data: Any = None) -> Any:
    """The operation on these inputs: a number or colour if all of them are, else an expression."""
    if operation in ASKING or any(isinstance(value, Expression) for value in inputs):
        return Expression(operation, inputs, data)
    extra = () if data is None else (data,)
    with np.errstate(all="ignore"):  # what is not finite is clamped
        return _plain(OPERATIONS[operation](*(_column(value, np.float64) for value in inputs), *extra))


def _column(value: Any, dtype: Any) -> Array:
    return np.array(value, dtype).reshape(-1, 1)


def _plain(result: Array) -> Any:
    numbers = np.clip(np.nan_to_num(result[:, 0]), -FINITE, FINITE).tolist()
    return numbers[0] if len(numbers) == 1 else tuple(numbers)


def clamped(value: Value) -> Any:
    """`value` within 0..1."""
    return apply("clamp", value, 0.0, 1.0)


def times(*values: Value) -> Any:
    """The product. A factor 0 is 0 and a factor 1 is left out, so that nothing varies without need."""
    result: Any = values[0]
    for value in values[1:]:
        if value == 1.0 or result == 0.0:
            continue
        result = value if result == 1.0 else 0.0 if value == 0.0 else apply("multiply", result, value)
    return result


def plus(first: Value, second: Value) -> Any:
    """The sum."""
    return second if first == 0.0 else first if second == 0.0 else apply("add", first, second)


def rest(value: Number) -> Any:
    """1 - value."""
    return apply("subtract", 1.0, value)


def as_color(value: Value) -> Color:
    """Constants as three numbers; expressions broadcast by themselves."""
    return (value, value, value) if isinstance(value, float | int) else value


def reads(surface: Surface) -> set[str]:
    """Keys of the data of a mesh's corners that a surface reads."""
    keys = set()
    for e in expressions_of(surface):
        if e.operation == "attribute" and e.data.partition(":")[0] in ATTRIBUTE_WIDTHS:
            keys.add(e.data)
        elif e.operation in ("image", "image_alpha") and not e.inputs:
            keys.add("uv:" + e.data.uv_map)
    return keys


def expressions_of(surface: Surface) -> list[Expression]:
    """All that its fields, and the weights and fields of its closures, are made of."""
    parts = [surface, *(closure.surface for closure in surface.closures)]
    values = [getattr(part, field.name) for part in parts for field in fields(part)]
    return list(walk(*values, *(closure.weight for closure in surface.closures)))


def walk(*values: object) -> Iterator[Expression]:
    """All expressions that values are made of, each once: by sharing them, n nodes make up to 2 ** n paths."""
    seen: set[int] = set()
    waiting = list(reversed(values))
    while waiting:
        value = waiting.pop()
        if isinstance(value, Expression) and id(value) not in seen:
            seen.add(id(value))
            yield value
            waiting.extend(reversed(value.inputs))


# ------------------------------------------------------------------------------------------------ working out


class Evaluation:
    """Values of expressions at some hits, each worked out once."""

    def __init__(self, hits: Hits) -> None:
        self._hits = hits
        self._known: dict[int, Array] = {}
        self._images: dict[tuple[int, ...], Array] = {}

    def __call__(self, value: Value) -> Array:
        """(1 or 3, n or 1) float32."""
        if not isinstance(value, Expression):
            return _column(value, np.float32)
        key = id(value)
        if key not in self._known:
            self._known[key] = self._work_out(value)
        return self._known[key]

    def _work_out(self, expression: Expression) -> Array:
        if expression.operation == "slope":
            height = expression.inputs[0]
            return np.asarray(self._hits.gradient(lambda hits: Evaluation(hits)(height)), np.float32)
        inputs = [self(value) for value in expression.inputs]
        if expression.operation in ("image", "image_alpha"):
            rgba = self._image(expression, inputs)
            return rgba[3:] if expression.operation == "image_alpha" else rgba[:3]
        if expression.operation == "attribute":
            return self._hits.attribute(expression.data)
        extra = () if expression.data is None else (expression.data,)
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            result = OPERATIONS[expression.operation](*inputs, *extra)
        return np.asarray(result, np.float32)

    def _image(self, expression: Expression, inputs: list[Array]) -> Array:
        """Color and Alpha of one image are looked up once."""
        key = (id(expression.data), *(id(value) for value in expression.inputs))
        if key not in self._images:
            self._images[key] = self._hits.image(expression.data, inputs[0] if inputs else None)
        return self._images[key]
