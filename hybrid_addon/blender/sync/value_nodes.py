# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes that work on values: mathematics, colours, vectors. See `values`."""

from __future__ import annotations

from typing import Any

import numpy as np

from ... import expressions as ex
from ...scene import Float64, Value
from .nodes import Node
from .texture import NodeReader
from .values import NODES, color, number, value_of, vector

TABLE_STEPS = 257
"""Of colour ramps and curves, as EEVEE tabulates them."""

MATH = {
    "ADD": "add", "SUBTRACT": "subtract", "MULTIPLY": "multiply", "DIVIDE": "divide", "POWER": "power",
    "MINIMUM": "minimum", "MAXIMUM": "maximum", "LESS_THAN": "less", "GREATER_THAN": "greater", "MODULO": "modulo",
    "ARCTAN2": "arctangent2", "MULTIPLY_ADD": "multiply_add", "LOGARITHM": "logarithm", "FLOORED_MODULO": "wrap",
    "COMPARE": "compare", "SNAP": "snap", "PINGPONG": "pingpong", "WRAP": "wrap_between",
    "SQRT": "root", "ABSOLUTE": "absolute", "FLOOR": "floor", "CEIL": "ceil", "ROUND": "round", "FRACT": "fraction",
    "SINE": "sine", "COSINE": "cosine", "TANGENT": "tangent", "ARCSINE": "arcsine", "ARCCOSINE": "arccosine",
    "ARCTANGENT": "arctangent", "EXPONENT": "exponent", "SIGN": "sign", "TRUNC": "truncate",
    "RADIANS": "radians", "DEGREES": "degrees", "INVERSE_SQRT": "inverse_root",
}  # fmt: skip
VECTOR_MATH = {
    "ADD": "add", "SUBTRACT": "subtract", "MULTIPLY": "multiply", "DIVIDE": "divide", "MULTIPLY_ADD": "multiply_add",
    "CROSS_PRODUCT": "cross", "DOT_PRODUCT": "dot", "LENGTH": "length", "NORMALIZE": "normalize", "FLOOR": "floor",
    "CEIL": "ceil", "FRACTION": "fraction", "MODULO": "modulo", "ABSOLUTE": "absolute", "MINIMUM": "minimum",
    "MAXIMUM": "maximum", "SINE": "sine", "COSINE": "cosine", "TANGENT": "tangent", "SNAP": "snap", "POWER": "power",
    "SIGN": "sign",
}  # fmt: skip
INPUTS = {"MULTIPLY_ADD": 3, "COMPARE": 3, "WRAP": 3}
ONE_INPUT = {
    "root", "absolute", "floor", "ceil", "round", "fraction", "sine", "cosine", "tangent", "arcsine", "arccosine",
    "arctangent", "exponent", "sign", "truncate", "radians", "degrees", "inverse_root", "length", "normalize",
}  # fmt: skip
BLENDS = {
    "ADD": "add", "SUBTRACT": "subtract", "MULTIPLY": "multiply", "SCREEN": "screen", "DIVIDE": "divide",
    "DIFFERENCE": "difference", "DARKEN": "minimum", "LIGHTEN": "maximum", "OVERLAY": "overlay",
    "SOFT_LIGHT": "soft_light", "EXCLUSION": "exclusion",
}  # fmt: skip


def _math(node: Node, output: str, reader: NodeReader) -> Value | None:
    b_node = node.b_node
    operation = MATH.get(b_node.operation)
    if operation is None:
        return None
    count = 1 if operation in ONE_INPUT else INPUTS.get(b_node.operation, 2)
    result = ex.apply(operation, *(number(reader, node, i) for i in range(count)))
    return ex.clamped(result) if b_node.use_clamp else result


def _vector_math(node: Node, output: str, reader: NodeReader) -> Value | None:
    kind = node.b_node.operation
    if kind == "SCALE":
        return ex.times(vector(reader, node, 0), number(reader, node, "Scale"))
    if kind == "DISTANCE":
        return ex.apply("length", ex.apply("subtract", vector(reader, node, 0), vector(reader, node, 1)))
    operation = VECTOR_MATH.get(kind)
    if operation is None:
        return None
    count = 1 if operation in ONE_INPUT else INPUTS.get(kind, 2)
    return ex.apply(operation, *(vector(reader, node, i) for i in range(count)))


def blended(kind: str, factor: Value, a: Value, b: Value) -> Value | None:
    """Mix Color; None for the blend types that are not followed."""
    if kind == "MIX":
        return ex.apply("mix", factor, a, b)
    if kind == "LINEAR_LIGHT":
        return ex.apply("add", a, ex.times(factor, ex.apply("subtract", ex.times(2.0, b), 1.0)))
    if kind == "DODGE":
        return ex.apply("dodge", a, ex.times(factor, b))
    if kind == "BURN":
        return ex.apply("burn", a, ex.apply("mix", factor, 1.0, b))
    operation = BLENDS.get(kind)
    return None if operation is None else ex.apply("mix", factor, a, ex.apply(operation, a, b))


def _mix_rgb(node: Node, output: str, reader: NodeReader) -> Value | None:
    factor = ex.clamped(number(reader, node, 0))
    result = blended(node.b_node.blend_type, factor, color(reader, node, 1), color(reader, node, 2))
    return ex.clamped(result) if node.b_node.use_clamp and result is not None else result


def _mix(node: Node, output: str, reader: NodeReader) -> Value | None:
    b_node = node.b_node
    kind = {"FLOAT": "Float", "VECTOR": "Vector", "RGBA": "Color"}.get(b_node.data_type)
    if kind is None:
        return None
    uneven = kind == "Vector" and b_node.factor_mode == "NON_UNIFORM"
    socket_kind = {"Float": "VALUE", "Vector": "VECTOR", "Color": "RGBA"}[kind]
    factor_name, factor_kind = ("Factor_Vector", "VECTOR") if uneven else ("Factor_Float", "VALUE")
    factor = value_of(reader, node.identified(factor_name), factor_kind)
    a, b = (value_of(reader, node.identified(f"{side}_{kind}"), socket_kind) for side in "AB")
    factor = ex.clamped(factor) if b_node.clamp_factor else factor
    result = blended(b_node.blend_type if kind == "Color" else "MIX", factor, a, b)
    return ex.clamped(result) if kind == "Color" and b_node.clamp_result and result is not None else result


def _invert(node: Node, output: str, reader: NodeReader) -> Value:
    given = color(reader, node, "Color")
    return ex.apply("mix", number(reader, node, 0), given, ex.rest(given))


def _hue_saturation(node: Node, output: str, reader: NodeReader) -> Value:
    hue, saturation, value = (number(reader, node, n) for n in ("Hue", "Saturation", "Value"))
    factor = number(reader, node, 3)
    return ex.apply("hue_saturation", hue, saturation, value, factor, color(reader, node, "Color"))


def _gamma(node: Node, output: str, reader: NodeReader) -> Value:
    return ex.apply("gamma", color(reader, node, "Color"), number(reader, node, "Gamma"))


def _bright_contrast(node: Node, output: str, reader: NodeReader) -> Value:
    bright, contrast = number(reader, node, 1), number(reader, node, "Contrast")
    scaled = ex.times(color(reader, node, "Color"), ex.plus(1.0, contrast))
    shift = ex.apply("subtract", bright, ex.times(0.5, contrast))
    return ex.apply("maximum", ex.apply("add", scaled, shift), 0.0)


def _clamp(node: Node, output: str, reader: NodeReader) -> Value:
    return ex.apply("clamp", *(number(reader, node, i) for i in range(3)))


def _map_range(node: Node, output: str, reader: NodeReader) -> Value | None:
    b_node = node.b_node
    if b_node.data_type != "FLOAT" or b_node.interpolation_type == "STEPPED":
        return None
    value, low, high, to_low, to_high = (number(reader, node, i) for i in range(5))
    t = ex.apply("divide", ex.apply("subtract", value, low), ex.apply("subtract", high, low))
    if b_node.interpolation_type != "LINEAR":
        t = ex.apply("smooth" if b_node.interpolation_type == "SMOOTHSTEP" else "smoother", t)
    elif b_node.clamp:
        t = ex.clamped(t)
    return ex.apply("mix", t, to_low, to_high)


def _color_ramp(node: Node, output: str, reader: NodeReader) -> Value:
    b_ramp = node.b_node.color_ramp
    table = np.array([tuple(b_ramp.evaluate(i / (TABLE_STEPS - 1))) for i in range(TABLE_STEPS)])
    return ex.apply("ramp", number(reader, node, 0), data=table[:, 3:] if output == "Alpha" else table[:, :3])


def _curve_table(b_mapping: Any, numbers: tuple[int, ...], common: int | None) -> Float64:
    b_mapping.initialize()
    rows = []
    for i in range(TABLE_STEPS):
        x = i / (TABLE_STEPS - 1)
        x = x if common is None else b_mapping.evaluate(b_mapping.curves[common], x)
        rows.append([b_mapping.evaluate(b_mapping.curves[n], x) for n in numbers])
    return np.array(rows)


def _rgb_curves(node: Node, output: str, reader: NodeReader) -> Value:
    given = color(reader, node, "Color")
    curved = ex.apply("curves", given, data=_curve_table(node.b_node.mapping, (0, 1, 2), 3))
    return ex.apply("mix", number(reader, node, 0), given, curved)


def _float_curve(node: Node, output: str, reader: NodeReader) -> Value:
    given = number(reader, node, "Value")
    curved = ex.apply("ramp", given, data=_curve_table(node.b_node.mapping, (0,), None))
    return ex.apply("mix", number(reader, node, 0), given, curved)


def _gray(node: Node, output: str, reader: NodeReader) -> Value:
    return ex.apply("gray", color(reader, node, "Color"))


def _separate(node: Node, output: str, reader: NodeReader) -> Value | None:
    if node.kind == "ShaderNodeSeparateXYZ":
        given, mode = vector(reader, node, 0), "RGB"
    else:
        given, mode = color(reader, node, 0), getattr(node.b_node, "mode", "RGB")
    if node.kind == "ShaderNodeSeparateHSV" or mode == "HSV":
        given = ex.apply("rgb_to_hsv", given)
    elif mode != "RGB":
        return None
    names = [b_socket.name for b_socket in node.b_node.outputs]
    return ex.apply("channel", given, data=names.index(output))


def _combine(node: Node, output: str, reader: NodeReader) -> Value | None:
    mode = getattr(node.b_node, "mode", "RGB")
    joined = ex.apply("join", *(number(reader, node, i) for i in range(3)))
    if node.kind == "ShaderNodeCombineHSV" or mode == "HSV":
        return ex.apply("hsv_to_rgb", joined)
    return joined if mode == "RGB" else None


def _ambient_occlusion(node: Node, output: str, reader: NodeReader) -> Value:
    reader.give_up(f"node {node.name!r}: ambient occlusion is not traced; it is 1")
    return color(reader, node, "Color") if output == "Color" else 1.0


NODES.update(
    {
        "ShaderNodeMath": _math,
        "ShaderNodeVectorMath": _vector_math,
        "ShaderNodeMixRGB": _mix_rgb,
        "ShaderNodeMix": _mix,
        "ShaderNodeInvert": _invert,
        "ShaderNodeHueSaturation": _hue_saturation,
        "ShaderNodeGamma": _gamma,
        "ShaderNodeBrightContrast": _bright_contrast,
        "ShaderNodeClamp": _clamp,
        "ShaderNodeMapRange": _map_range,
        "ShaderNodeValToRGB": _color_ramp,
        "ShaderNodeRGBCurve": _rgb_curves,
        "ShaderNodeFloatCurve": _float_curve,
        "ShaderNodeRGBToBW": _gray,
        "ShaderNodeSeparateColor": _separate,
        "ShaderNodeSeparateRGB": _separate,
        "ShaderNodeSeparateHSV": _separate,
        "ShaderNodeSeparateXYZ": _separate,
        "ShaderNodeCombineColor": _combine,
        "ShaderNodeCombineRGB": _combine,
        "ShaderNodeCombineHSV": _combine,
        "ShaderNodeCombineXYZ": _combine,
        "ShaderNodeAmbientOcclusion": _ambient_occlusion,
    }
)
