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

from .procedural import TEXTURES
from .scene import Color, Expression, Number, Surface, Texture, Value

Array = NDArray[Any]

LUMINANCE = (0.2126, 0.7152, 0.0722)  # of Blender's default working space (EEVEE's node RGB to BW)
WIDTHS = {"uv": 2, "color": 4, "generated": 3, "object": 3, "tangent": 4}
"""Numbers of a mesh's corner, by the first word of an attribute's key; other attributes the hits themselves know."""

FINITE = 1e30  # results are clamped to +- this: a division by 0 in a node must not end as NaN in a picture


class Hits(Protocol):
    """What an expression may ask of n hits."""

    def image(self, texture: Texture, uv: Array | None) -> Array:
        """RGBA (4, n) at texture coordinates (2 or 3, n), or at the texture's own UV map for None."""

    def attribute(self, key: str) -> Array:
        """(width, n): "position", "normal", "incoming", "backfacing" or "cosine" (of the view angle) of the hits, or
        interpolated data of the mesh's corners; 0 where the mesh has none."""

    def gradient(self, value: Callable[[Any], Array]) -> Array:
        """(3, n): how a number grows along the surface, for each metre; `value` works it out at given hits."""


# ------------------------------------------------------------------------------------------------ operations


def _mix(t: Array, a: Array, b: Array) -> Array:
    return a + (b - a) * t


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


def _three(a: Array) -> Array:
    return np.broadcast_to(a, (3, a.shape[1])) if len(a) == 1 else a[:3]


def _ramp(t: Array, table: Array) -> Array:
    """A table (k, 1 or 3) over 0..1, linearly interpolated: what EEVEE does with ColorRamp and curves."""
    x = np.clip(t[0], 0, 1) * (len(table) - 1)
    i = np.minimum(x.astype(np.intp), len(table) - 2)
    f = (x - i).astype(t.dtype)
    low, high = table.take(i, axis=0).T.astype(t.dtype), table.take(i + 1, axis=0).T.astype(t.dtype)
    return low + (high - low) * f


def _curves(color: Array, table: Array) -> Array:
    """Three tables (k, 3), one for each channel."""
    return np.concatenate([_ramp(_three(color)[i : i + 1], table[:, i : i + 1]) for i in range(3)])


def _rgb_to_hsv(color: Array) -> Array:
    color = _three(color)
    high, low = color.max(axis=0), color.min(axis=0)
    spread = high - low
    safe = np.where(spread > 0, spread, 1)
    r, g, b = (high - color) / safe
    hue = np.where(color[0] == high, b - g, np.where(color[1] == high, 2 + r - b, 4 + g - r)) / 6 % 1
    return np.stack([np.where(spread > 0, hue, 0), np.where(high > 0, spread / np.where(high > 0, high, 1), 0), high])


def _hsv_to_rgb(hsv: Array) -> Array:
    h, s, v = hsv
    ramps = np.stack([np.abs(h * 6 - 3) - 1, 2 - np.abs(h * 6 - 2), 2 - np.abs(h * 6 - 4)])
    return ((np.clip(ramps, 0, 1) - 1) * s + 1) * v


def _hue_saturation(hue: Array, saturation: Array, value: Array, factor: Array, color: Array) -> Array:
    h, s, v = _rgb_to_hsv(color)
    shifted = np.stack([(h + hue[0] + 0.5) % 1, np.clip(s * saturation[0], 0, 1), v * value[0]])
    return _mix(factor, _three(color), np.maximum(_hsv_to_rgb(shifted), 0))


def _checker(p: Array, a: Array, b: Array, scale: Array) -> Array:
    """Checker Texture; the shift keeps faces of a unit cube off the boundaries of cells."""
    q = np.floor((p * scale + 1e-6) * 0.9999990).astype(np.int64)
    return np.where(((q[0] + q[1] + q[2]) % 2 == 1)[None], _three(a), _three(b))


def _checker_factor(p: Array, scale: Array) -> Array:
    one, nought = np.ones((1, 1), p.dtype), np.zeros((1, 1), p.dtype)
    return _checker(p, one, nought, scale)[:1]


def _gradient(p: Array, kind: str) -> Array:
    """Gradient Texture."""
    x, y, z = p
    ball = np.maximum(0.999999 - np.sqrt(x * x + y * y + z * z), 0)
    kinds: dict[str, Callable[[], Array]] = {
        "LINEAR": lambda: x,
        "QUADRATIC": lambda: np.maximum(x, 0) ** 2,
        "EASING": lambda: np.clip(x, 0, 1) ** 2 * (3 - 2 * np.clip(x, 0, 1)),
        "DIAGONAL": lambda: (x + y) * 0.5,
        "RADIAL": lambda: np.arctan2(y, x) / (2 * np.pi) + 0.5,
        "QUADRATIC_SPHERE": lambda: ball * ball,
        "SPHERICAL": lambda: ball,
    }
    return np.clip(kinds[kind]()[None], 0, 1)


def _affine(p: Array, matrix: Array) -> Array:
    """A (3, 4) matrix, as of a Mapping node, on points of 2 or 3 rows."""
    rows = [*p, *[np.zeros_like(p[0])] * (3 - len(p))]
    return np.stack([m[0] * rows[0] + m[1] * rows[1] + m[2] * rows[2] + m[3] for m in matrix])


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


def _dodge(a: Array, b: Array) -> Array:
    return np.where(a == 0, 0, np.where(b >= 1, 1, np.minimum(a / np.where(b < 1, 1 - b, 1), 1)))


def _burn(a: Array, b: Array) -> Array:
    return np.clip(1 - (1 - a) / np.where(b > 0, b, 1e-30), 0, 1)


def _wrap_sphere(p: Array) -> Array:
    x, y, z = 2 * _three(p) - 1
    length = np.maximum(np.sqrt(x * x + y * y + z * z), 1e-30)
    u = np.where((x == 0) & (y == 0), 0, (1 - np.arctan2(x, y) / np.pi) / 2)
    return np.stack([u, 1 - np.arccos(np.clip(z / length, -1, 1)) / np.pi, np.zeros_like(u)])


def _wrap_tube(p: Array) -> Array:
    x, y, z = 2 * _three(p) - 1
    u = np.where((x == 0) & (y == 0), 0, (1 - np.arctan2(x, y) / np.pi) / 2)
    return np.stack([u, (z + 1) / 2, np.zeros_like(u)])


def _box_view(p: Array, normal: Array, axis: int) -> Array:
    """Texture coordinates of a box projection along an axis, mirrored so that no side is inside out."""
    x, y, z = _three(p)
    turned = normal[axis] < 0
    u, v = ((y, z), (x, z), (y, x))[axis]
    u = np.where(turned != (axis == 1), 1 - u, u)
    return np.stack([u, v, np.zeros_like(u)])


def _box_weights(normal: Array, blend: float) -> Array:
    """Shares of the three views: one for each side, with `blend` a soft change between them."""
    n = np.abs(normal) / np.maximum(np.abs(normal).sum(axis=0, keepdims=True), 1e-30)
    limit = 0.5 * (1 - blend)
    first = np.eye(3)[np.argmax(n, axis=0)].T
    if blend <= 0:
        return first
    two = [np.clip((n[i] / np.maximum(n[i] + n[j], 1e-30) - limit) / blend, 0, 1) for i, j in ((0, 1), (0, 2), (1, 2))]
    soft = np.stack([two[0] * two[1], (1 - two[0]) * two[2], (1 - two[1]) * (1 - two[2])])
    total = soft.sum(axis=0, keepdims=True)
    return np.where(total > 0, soft / np.where(total > 0, total, 1), first)


def _screen(a: Array, b: Array) -> Array:
    return 1 - (1 - a) * (1 - b)


def _overlay(a: Array, b: Array) -> Array:
    return np.where(a < 0.5, 2 * a * b, 1 - 2 * (1 - a) * (1 - b))


def _soft_light(a: Array, b: Array) -> Array:
    return (1 - a) * b * a + a * _screen(a, b)


def _normalize(v: Array) -> Array:
    length = np.sqrt((v * v).sum(axis=0, keepdims=True))
    return np.asarray(v / np.where(length > 0, length, 1))


def _dot(a: Array, b: Array) -> Array:
    return np.asarray((_three(a) * _three(b)).sum(axis=0, keepdims=True))


def _cross(a: Array, b: Array) -> Array:
    a, b = _three(a), _three(b)
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _normal_map(color: Array, strength: Array, tangent: Array, normal: Array) -> Array:
    """Tangent space; a tangent (4, n) has the sign of the bitangent in its last row."""
    x, y, z = 2 * _three(color) - 1
    bitangent = tangent[3] * _cross(normal, tangent[:3])
    mapped = _normalize(tangent[:3] * x + bitangent * y + normal * z)
    mapped = np.where((tangent[:3] != 0).any(axis=0), mapped, normal)
    return _normalize(_mix(np.maximum(strength, 0), normal, mapped))


def _bump(gradient: Array, strength: Array, distance: Array, normal: Array) -> Array:
    """Mikkelsen 2010, Bump mapping unparametrized surfaces on the GPU."""
    return _normalize(_mix(np.maximum(strength, 0), normal, _normalize(normal - distance * gradient)))


def _fresnel(cosine: Array, ior: Array) -> Array:
    """Of a dielectric (Cook & Torrance 1982)."""
    c = np.abs(cosine)
    g2 = ior * ior - 1 + c * c
    g = np.sqrt(np.maximum(g2, 0))
    a = (g - c) / (g + c)
    b = ((g + c) * c - 1) / ((g - c) * c + 1)
    return np.where(g2 > 0, 0.5 * a * a * (1 + b * b), 1)


def _smooth(x: Array) -> Array:
    x = np.clip(x, 0, 1)
    return x * x * (3 - 2 * x)


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
    "screen": _screen,
    "overlay": _overlay,
    "soft_light": _soft_light,
    "difference": lambda a, b: np.abs(a - b),
    "gray": _gray,
    "average": _average,
    "join": _join,
    "channel": lambda a, data: a[min(data, len(a) - 1)][None],
    "rows": lambda a, data: a[data[0] : data[1]],
    "ramp": _ramp,
    "curves": _curves,
    "rgb_to_hsv": _rgb_to_hsv,
    "hsv_to_rgb": _hsv_to_rgb,
    "hue_saturation": _hue_saturation,
    "checker": _checker,
    "checker_factor": _checker_factor,
    "gradient": _gradient,
    "affine": _affine,
    "gamma": lambda a, b: np.where(a > 0, _power(np.where(a > 0, a, 1), b), a),
    "exclusion": lambda a, b: np.maximum(a + b - 2 * a * b, 0),
    "dodge": _dodge,
    "burn": _burn,
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
    "wrap_sphere": _wrap_sphere,
    "wrap_tube": _wrap_tube,
    "box_view": _box_view,
    "box_weights": _box_weights,
    "dot": _dot,
    "cross": _cross,
    "length": lambda a: np.sqrt(_dot(a, a)),
    "normalize": _normalize,
    "normal_map": _normal_map,
    "bump": _bump,
    "fresnel": _fresnel,
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
        if e.operation == "attribute" and e.data.partition(":")[0] in WIDTHS:
            keys.add(e.data)
        elif e.operation in ("image", "image_alpha") and not e.inputs:
            keys.add("uv:" + e.data.uv_map)
    return keys


def expressions_of(surface: Surface) -> list[Expression]:
    """All that its fields are made of, the texture of the base colour included."""
    values = [getattr(surface, field.name) for field in fields(surface)]
    if surface.base_color_texture is not None:
        values.append(Expression("image", (), surface.base_color_texture))
    return [e for value in values for e in walk(value)]


def walk(value: object) -> Iterator[Expression]:
    """All expressions that a value is made of."""
    if isinstance(value, Expression):
        yield value
        for given in value.inputs:
            yield from walk(given)


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
