# SPDX-License-Identifier: GPL-3.0-or-later
"""The same file through Cycles, kept inside what a Whitted tracer does: a renderer that is not ours to compare with.

No diffuse bounces, no clamping, no roulette, EEVEE's pixel filter; lamps are seen in mirrors and through glass, with
their size, but not by the camera, as in EEVEE. Surfaces with Custom values, which Cycles does not know, get a material
that says the same. The open file is changed for good.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import bpy
import numpy as np

from ...clock import Clock
from ...scene import Color, Expression, Float64, Scene, Surface
from ...tracer.core.constants import FILTER_SIGMA
from ..errors import HybridError
from ..pipeline import scene_setup
from ..render import images
from ..sync.settings import custom_surface
from ..sync.sums import singles

HOW = "Cycles' Whitted subset of the same file: the same lamps and roughness, no diffuse bounces, nothing clamped"


def whitted_subset(b_scene: bpy.types.Scene, scene: Scene, max_depth: int) -> None:
    """Make the file Cycles' own. scene: its translation, for the Custom surfaces. HybridError if there is no Cycles."""
    ray_traced = scene_setup.ray_traced_objects(b_scene)
    scene_setup.disable(b_scene)
    try:
        b_scene.render.engine = "CYCLES"
    except TypeError as error:
        raise HybridError("this Blender has no Cycles: enable its add-on") from error
    c = b_scene.cycles
    c.device, c.use_adaptive_sampling, c.use_denoising = "CPU", False, False
    c.max_bounces = c.glossy_bounces = c.transmission_bounces = c.transparent_max_bounces = max_depth
    c.min_light_bounces = c.min_transparent_bounces = max_depth
    c.diffuse_bounces = c.volume_bounces = 0
    c.blur_glossy = c.sample_clamp_direct = c.sample_clamp_indirect = 0.0
    c.caustics_reflective = c.caustics_refractive = True
    # Cycles' Gaussian is exp(-2 (6 x / width)^2): a standard deviation of width / 12.
    c.pixel_filter_type, c.filter_width = "GAUSSIAN", min(10.0, 12 * FILTER_SIGMA * b_scene.render.filter_size)
    surfaces = {i.name: [singles(scene.surfaces[s])[0] for s in i.surfaces] for i in scene.instances if i.ray_traced}
    for b_object in b_scene.objects:
        if b_object.type == "LIGHT":
            b_object.visible_camera = False
    for b_object in ray_traced:
        _say_custom(b_object, surfaces.get(b_object.name, []))


def draw(b_scene: bpy.types.Scene, samples: int, seed: int) -> tuple[Float64, dict[str, float]]:
    """Radiance (h, w, 3), 0 outside of the render border, and what the whole render took."""
    b_scene.cycles.samples, b_scene.cycles.seed = samples, seed
    clock = Clock()
    bpy.ops.render.render(scene=b_scene.name)
    spent = clock.read()
    planes = images.read_render_result(b_scene)
    picture = next(pixels for name, pixels in planes.items() if name.endswith("Combined"))
    return picture[..., :3].astype(np.float64), spent


def limit(b_scene: bpy.types.Scene, box: tuple[int, int, int, int], size: tuple[int, int]) -> None:
    """Render only a rectangle (x0, y0, x1, y1) of pixels, half open, at its place in the full frame."""
    b_render = b_scene.render
    b_render.use_border, b_render.use_crop_to_border = True, False
    half = 0.5  # Blender rounds down: aim at the middle of a pixel
    b_render.border_min_x, b_render.border_max_x = (box[0] + half) / size[0], min(1.0, (box[2] + half) / size[0])
    b_render.border_min_y, b_render.border_max_y = (box[1] + half) / size[1], min(1.0, (box[3] + half) / size[1])


def _say_custom(b_object: bpy.types.Object, surfaces: list[Surface]) -> None:
    """Custom surfaces as materials."""
    for number, b_slot in enumerate(b_object.material_slots):
        custom = custom_surface(b_object).over(custom_surface(b_slot.material))
        if custom.values is not None and number < len(surfaces):
            b_slot.link = "OBJECT"
            b_slot.material = _custom(b_slot.material, custom.values, surfaces[number])


def _custom(
    b_material: bpy.types.Material | None, values: tuple[float, float, float], surface: Surface
) -> bpy.types.Material:
    """r glossy + (1 - r) [o diffuse + (1 - o) glass] + emission, with the colours, or picture, of the original."""
    b_own = b_material.copy() if b_material else bpy.data.materials.new("Whitted")
    if not b_own.node_tree:
        b_own.use_nodes = True
    b_tree = b_own.node_tree
    b_source = None
    for b_node in b_tree.nodes:
        if b_node.type == "BSDF_PRINCIPLED" and b_node.inputs["Base Color"].is_linked:
            b_source = b_node.inputs["Base Color"].links[0].from_socket
    b_output = next((n for n in b_tree.nodes if n.type == "OUTPUT_MATERIAL" and n.is_active_output), None)
    b_output = b_output or b_tree.nodes.new("ShaderNodeOutputMaterial")

    def node(kind: str, values: Mapping[str, Any]) -> bpy.types.Node:
        return _set(b_tree.nodes.new(f"ShaderNode{kind}"), values)

    def mix(fac: float, a: bpy.types.Node, b: bpy.types.Node) -> bpy.types.Node:
        b_mix = node("MixShader", {"Fac": fac})
        b_tree.links.new(b_mix.inputs[1], a.outputs[0])
        b_tree.links.new(b_mix.inputs[2], b.outputs[0])
        return b_mix

    reflectivity, opacity, ior = values
    diffuse = node("BsdfDiffuse", {"Color": _rgba(surface.base_color), "Roughness": 0.0})
    if b_source is not None:
        b_tree.links.new(diffuse.inputs["Color"], b_source)
    glass = node("BsdfGlass", {"Color": _rgba(surface.transmission_tint), "Roughness": 0.0, "IOR": ior})
    glossy = node("BsdfAnisotropic", {"Color": _rgba(surface.reflection_tint), "Roughness": 0.0})
    emission = node("Emission", {"Color": _rgba(surface.emission), "Strength": 1.0})
    b_sum = b_tree.nodes.new("ShaderNodeAddShader")
    body = mix(reflectivity, mix(1 - opacity, diffuse, glass), glossy)
    b_tree.links.new(b_sum.inputs[0], body.outputs[0])
    b_tree.links.new(b_sum.inputs[1], emission.outputs[0])
    b_tree.links.new(b_output.inputs["Surface"], b_sum.outputs[0])
    return b_own


def _rgba(color: Color) -> tuple[float, float, float, float]:
    """What varies over a surface is white, or comes from the node that it came from."""
    return (1.0, 1.0, 1.0, 1.0) if isinstance(color, Expression) else (*color, 1.0)


def _set(b_node: bpy.types.Node, values: Mapping[str, Any]) -> bpy.types.Node:
    for name, value in values.items():
        b_node.inputs[name].default_value = value
    return b_node
