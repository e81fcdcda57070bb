# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes that know the ray, the object, the camera or a spectrum -> values. See `values`.

Where EEVEE gives a constant, as for what only Cycles knows, so does the traced half: both draw one picture. Of the ray
EEVEE knows little; there the tracer answers for its own rays, as Cycles does (tracer/shading/hit_data.py).
"""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ... import expressions as ex
from ...procedural.spectra import working_space
from ...scene import Float64, Value
from .nodes import Node
from .object_values import rgba_in
from .texture import NodeReader
from .value_nodes import TABLE_STEPS
from .values import NODES, NORMAL, attribute, number, once, vector

LIGHT_RAYS = ("Is Glossy Ray", "Is Singular Ray", "Is Reflection Ray", "Is Transmission Ray")
"""What EEVEE's rays to the world are when it is to light, all at once."""
NEVER = ("Is Volume Scatter Ray", "Portal Depth")
"""Outputs of Light Path that are 0: traced fog is marched through without new rays, and portals are Cycles' alone."""

NORMALS_ARE_VECTORS = bpy.app.version < (5, 0, 0)
"""EEVEE of Blender 4.5 turns the normals of Vector Transform as vectors; so it matters under uneven scale."""

FLIPPED = np.diag([1.0, 1.0, -1.0, 1.0])  # nodes know camera space with +z to the front
AROUND = {  # from Generated coordinates to a direction around an axis (gpu_shader_material_tangent.glsl)
    "X": ((0, 0, 0, 0), (0, 0, -0.5, 0.25), (0, 0.5, 0, -0.25)),
    "Y": ((0, 0, -0.5, 0.25), (0, 0, 0, 0), (0.5, 0, 0, -0.25)),
    "Z": ((0, -0.5, 0, 0.25), (0.5, 0, 0, -0.25), (0, 0, 0, 0)),
}


def _light_path(node: Node, output: str, reader: NodeReader) -> Value:
    if reader.camera is not None:
        reader.light_path = True
        return float(output == "Is Camera Ray" if reader.camera else output in LIGHT_RAYS)
    return 0.0 if output in NEVER else attribute(ex.RAY + output)


# ------------------------------------------------------------------------------------------------ the object


def _object_info(node: Node, output: str, reader: NodeReader) -> Value | None:
    if reader.camera is not None:
        return None
    if output == "Material Index":
        return float(reader.material_index)
    keys = {"Location": "location", "Color": "color", "Alpha": "alpha", "Object Index": "index", "Random": "random"}
    return attribute(ex.INSTANCE + keys[output]) if output in keys else None


def _attribute(node: Node, output: str, reader: NodeReader) -> Value | None:
    b_node = node.b_node
    kind = getattr(b_node, "attribute_type", "GEOMETRY")
    name = b_node.layer_name if node.kind == "ShaderNodeVertexColor" else b_node.attribute_name
    three: Any
    if kind == "VIEW_LAYER":
        rgba = next(filter(None, (rgba_in(b_owner, name) for b_owner in reader.frame.b_owners)), (0.0,) * 4)
        three, alpha = rgba[:3], rgba[3]
    elif reader.grids is not None and kind == "GEOMETRY":  # in a volume: a grid
        found = attribute(f"{ex.VOLUME}:{name}") if name in reader.grids else (0.0, 0.0, 0.0)
        width = reader.grids.get(name, 3)
        three = ex.apply("first_three", found) if width > 1 else ex.as_color(found)
        alpha = ex.apply("channel", found, data=3) if width > 3 else 1.0
    elif reader.camera is not None:
        return None
    else:
        keys = {"OBJECT": f"{ex.INSTANCE}object:{name}", "INSTANCER": f"{ex.INSTANCE}instancer:{name}"}
        four = attribute(keys.get(kind, "color:" + name))
        three, alpha = ex.apply("first_three", four), ex.apply("channel", four, data=3)
    if output == "Alpha":
        return alpha
    return ex.apply("average", three) if output in ("Fac", "Factor") else three


def _geometry(node: Node, output: str, reader: NodeReader) -> Value | None:
    keys = {"Position": "position", "Normal": "normal", "True Normal": "true_normal", "Incoming": "incoming"}
    keys["Backfacing"] = "backfacing"
    if output in keys:
        return attribute(keys[output])
    if output == "Tangent":
        return _around("Z")
    if output == "Parametric":
        pair = attribute("parametric")
        return ex.apply("join", ex.apply("channel", pair, data=0), ex.apply("channel", pair, data=1), 0.0)
    return {"Pointiness": 0.5, "Random Per Island": 0.0}.get(output)  # what EEVEE gives


def _around(axis: str) -> Value:
    """The direction around an axis of the object, along the surface (node_tangent)."""
    turned = ex.apply("affine", attribute("generated"), data=np.array(AROUND[axis], np.float64))
    direction = _of_instance(turned, "VECTOR", inverse=False)
    return ex.apply("cross", NORMAL, ex.apply("normalize", ex.apply("cross", direction, NORMAL)))


def _tangent(node: Node, output: str, reader: NodeReader) -> Value | None:
    b_node = node.b_node
    if reader.camera is not None:
        return None
    if b_node.direction_type == "RADIAL":
        return _around(b_node.axis)
    return ex.apply("normalize", ex.apply("first_three", attribute("tangent:" + b_node.uv_map)))


def _bevel(node: Node, output: str, reader: NodeReader) -> Value:
    """EEVEE rounds nothing."""
    return vector(reader, node, "Normal") if node.input("Normal").node() is not None else NORMAL


def _raycast(node: Node, output: str, reader: NodeReader) -> Value | None:
    """What a ray meets first. EEVEE looks for it in its own picture, Cycles in the scene, as rays do."""
    rows = {"Is Hit": (0,), "Self Hit": (1,), "Hit Distance": (2,), "Hit Position": (3, 4, 5), "Hit Normal": (6, 7, 8)}
    if reader.camera is not None or output not in rows:
        return None

    def cast() -> Value:
        linked = [node.input(name).node() is not None for name in ("Position", "Direction")]
        position = vector(reader, node, "Position") if linked[0] else attribute("position")
        direction = vector(reader, node, "Direction") if linked[1] else NORMAL
        inputs = position, direction, number(reader, node, "Length")
        return ex.apply("raycast", *inputs, data=bool(node.b_node.only_local))

    cast_ray = once(reader, node, cast, "raycast")
    found = [ex.apply("channel", cast_ray, data=row) for row in rows[output]]
    return found[0] if len(found) == 1 else ex.apply("join", *found)


# ------------------------------------------------------------------------------------------------ the camera, spaces


def _camera_data(node: Node, output: str, reader: NodeReader) -> Value | None:
    if reader.camera is not None:
        return None
    seen = ex.apply("affine", attribute("position"), data=_to_camera(reader)[:3])
    if output == "View Z Depth":
        return ex.apply("absolute", ex.apply("channel", seen, data=2))
    return ex.apply("length" if output == "View Distance" else "normalize", seen)


def _to_camera(reader: NodeReader) -> Float64:
    return np.asarray(FLIPPED @ np.linalg.inv(reader.frame.camera))


def _vector_transform(node: Node, output: str, reader: NodeReader) -> Value | None:
    """From one space to the world, and from there to the other."""
    b_node, given = node.b_node, vector(reader, node, "Vector")
    start, end = b_node.convert_from, b_node.convert_to
    if reader.camera is not None and "OBJECT" in (start, end):
        return None
    kind, of_normals = b_node.vector_type, b_node.vector_type == "NORMAL" and not NORMALS_ARE_VECTORS
    kind = "VECTOR" if kind == "NORMAL" and NORMALS_ARE_VECTORS else kind
    if start != end:
        if start == "OBJECT":
            given = _of_instance(given, kind, of_normals)
        elif start == "CAMERA":
            given = _by(np.linalg.inv(_to_camera(reader)), given, kind)
        if end == "OBJECT":
            given = _of_instance(given, kind, not of_normals)
        elif end == "CAMERA":
            given = _by(_to_camera(reader), given, kind)
    return ex.apply("normalize", given) if b_node.vector_type == "NORMAL" else given


def _of_instance(given: Value, kind: str, inverse: bool) -> Value:
    """By the matrix of the instance; normals turn by the other one's columns."""
    key = ex.INSTANCE + ("WORLD_TO_OBJECT" if inverse else "OBJECT_TO_WORLD")
    return ex.apply("transformed", given, attribute(key), data=kind)


def _by(matrix: Float64, given: Value, kind: str) -> Value:
    rows = matrix[:3].copy()
    rows[:, 3] *= kind == "POINT"
    return ex.apply("affine", given, data=rows)


# ------------------------------------------------------------------------------------------------ vectors, spectra


def _normal(node: Node, output: str, reader: NodeReader) -> Value:
    """Its direction is the default value of its own output."""
    x, y, z = node.b_node.outputs["Normal"].default_value
    direction = ex.apply("normalize", (x, y, z))
    if output == "Normal":
        return direction
    return ex.apply("dot", ex.apply("normalize", vector(reader, node, "Normal")), direction)


def _vector_curves(node: Node, output: str, reader: NodeReader) -> Value:
    given, b_mapping = vector(reader, node, "Vector"), node.b_node.mapping
    b_mapping.initialize()
    b_curves = [b_mapping.curves[i] for i in range(3)]
    low, high = (np.array([b_curve.points[end].location[0] for b_curve in b_curves]) for end in (0, -1))
    low, high = np.minimum(low, b_mapping.clip_min_x), np.maximum(high, b_mapping.clip_max_x)

    def at(x: Float64) -> list[float]:
        return [b_mapping.evaluate(b_curve, value) for b_curve, value in zip(b_curves, x, strict=True)]

    table = np.array([at(low + (high - low) * i / (TABLE_STEPS - 1)) for i in range(TABLE_STEPS)])
    slopes = np.array([table[0] - np.array(at(low - 1)), np.array(at(high + 1)) - table[-1]])
    curved = ex.apply("curves_beyond", given, data=(table, low, high, slopes))
    return ex.apply("mix", number(reader, node, 0), given, curved)


def _spectrum(node: Node, output: str, reader: NodeReader) -> Any:
    operation = "blackbody" if node.kind == "ShaderNodeBlackbody" else "wavelength"
    return ex.apply(operation, number(reader, node, 0), data=working_space(reader.frame.working_space))


def _light_falloff(node: Node, output: str, reader: NodeReader) -> Value:
    """The strength alone: light falls off as it does."""
    return number(reader, node, "Strength")


NODES.update(
    {
        "ShaderNodeLightPath": _light_path,
        "ShaderNodeObjectInfo": _object_info,
        "ShaderNodeAttribute": _attribute,
        "ShaderNodeVertexColor": _attribute,
        "ShaderNodeNewGeometry": _geometry,
        "ShaderNodeTangent": _tangent,
        "ShaderNodeBevel": _bevel,
        "ShaderNodeRaycast": _raycast,
        "ShaderNodeCameraData": _camera_data,
        "ShaderNodeVectorTransform": _vector_transform,
        "ShaderNodeNormal": _normal,
        "ShaderNodeVectorCurve": _vector_curves,
        "ShaderNodeBlackbody": _spectrum,
        "ShaderNodeWavelength": _spectrum,
        "ShaderNodeLightFalloff": _light_falloff,
    }
)
