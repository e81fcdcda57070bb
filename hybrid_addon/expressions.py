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

from .procedural.operations import OPERATIONS
from .scene import Color, Expression, Number, Surface, Texture, Value

Array = NDArray[Any]

ATTRIBUTE_WIDTHS = {
    "uv": 2, "color": 4, "generated": 3, "object": 3, "object_normal": 3, "tangent": 4, "parametric": 2, "strand": 4,
    "around": 4,
}  # fmt: skip
"""Numbers of a mesh's corner, by the first word of an attribute's key; other attributes the hits themselves know."""

RAY, INSTANCE = "ray:", "instance:"
"""How keys of attributes begin that are asked of the ray, by Light Path's outputs, and of the instance
(scene.Instance.values); "instance:OBJECT_TO_WORLD" and "instance:WORLD_TO_OBJECT" are its matrices, 12 numbers each."""

VOLUME = "volume"
"""First word of the keys of grids (scene.FogBody.grids)."""

FINITE = 1e30  # results are clamped to +- this: a division by 0 in a node must not end as NaN in a picture


class Hits(Protocol):
    """What an expression may ask of n hits."""

    def image(self, texture: Texture, uv: Array | None) -> Array:
        """RGBA (4, n) at texture coordinates (2 or 3, n), or at the texture's own UV map for None."""

    def attribute(self, key: str) -> Array:
        """(width, n): "position", "normal" (on the side of the eye), "interpolated_normal" (the same, as long as
        interpolation between the corners leaves it), "true_normal" (of the flat face, on that side), "incoming",
        "backfacing" or "cosine" (of the view angle) of the hits, what their rays or instances know (RAY, INSTANCE), or
        interpolated data of the mesh's corners; 0 where there is none."""

    def raycast(self, position: Array, direction: Array, length: Array, only_local: bool) -> Array:
        """(9, n) what rays in the scene hit first within `length` metres: whether something, whether the object itself,
        its distance (`length` of nothing), its place and its normal on the ray's side. position, direction: (3, n or
        1), a ray that starts at the hit itself leaves its surface. only_local: all other objects are not there."""

    def gradient(self, value: Callable[[Any], Array], on_facet: bool = False) -> Array:
        """(3, n): how a number grows along the surface, for each metre, less than 0 seen from the inner side; `value`
        works it out at given hits. on_facet: of metres across the normal, wherever the facet lies (it is displaced)."""


ASKING = ("image", "image_alpha", "attribute", "slope", "raycast")  # operations that ask the hits


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
    # Not nan_to_num and clip: for one number they take ten times as long.
    numbers = [float(min(max(n, -FINITE), FINITE)) if n == n else 0.0 for n in result[:, 0].tolist()]
    return numbers[0] if len(numbers) == 1 else tuple(numbers)


def held(value: Value) -> Expression:
    """A constant as an expression, for what takes no other; an expression is itself."""
    return value if isinstance(value, Expression) else Expression("held", (value,))


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


def casts_rays(surface: Surface) -> bool:
    """Whether a surface asks what rays from its places hit."""
    return any(e.operation == "raycast" for e in expressions_of(surface))


def reads_ray(surface: Surface) -> bool:
    """Whether a surface asks how the ray came that sees it."""
    return any(_is_attribute(e, RAY) for e in expressions_of(surface))


def depends_on_eye(surface: Surface) -> bool:
    """Whether it is another colour from each side: that of Fresnel and Layer Weight, or told by the ray."""
    seen = ("incoming", "cosine")
    return any(e.operation == "attribute" and e.data in seen for e in expressions_of(surface)) or reads_ray(surface)


def reads_of_instance(surface: Surface) -> set[str]:
    """Keys of what a surface reads of the instance that wears it."""
    return instance_keys(*expressions_of(surface))


def instance_keys(*values: object) -> set[str]:
    """Keys of what values ask of the instance."""
    return {e.data.removeprefix(INSTANCE) for e in walk(*values) if _is_attribute(e, INSTANCE)}


def grid_keys(*values: object) -> set[str]:
    """Names of the grids that values ask for."""
    start = VOLUME + ":"
    return {e.data.removeprefix(start) for e in walk(*values) if _is_attribute(e, start)}


def _is_attribute(e: Expression, kind: str) -> bool:
    return e.operation == "attribute" and e.data.startswith(kind)


def expressions_of(surface: Surface) -> list[Expression]:
    """All that its fields, and the weights and fields of its closures, are made of."""
    values = [getattr(part, field.name) for part in surface.parts for field in fields(part)]
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
            on_facet = () if expression.data is None else (expression.data,)
            return np.asarray(self._hits.gradient(lambda hits: Evaluation(hits)(height), *on_facet), np.float32)
        inputs = [self(value) for value in expression.inputs]
        if expression.operation in ("image", "image_alpha"):
            rgba = self._image(expression, inputs)
            return rgba[3:] if expression.operation == "image_alpha" else rgba[:3]
        if expression.operation == "attribute":
            return self._hits.attribute(expression.data)
        if expression.operation == "raycast":
            return self._hits.raycast(inputs[0], inputs[1], inputs[2], expression.data)
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
