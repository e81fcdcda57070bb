# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials that are ray traced by themselves: in the mask layer EEVEE holds out the faces that wear them.

A view layer holds out whole objects only. So in the evaluated copies of one render of the mask layer, which Blender
throws away with it, such a material becomes to camera rays a Holdout as far as it is opaque. Nothing of the user's data
is written to, nor what his viewports show; and whatever wears the material, by a slot, by geometry nodes, as an
instance, is held out with it.
"""

from __future__ import annotations

from functools import partial

import bpy

from ..flags import background_sets, is_traced_by_itself
from ..instancing import shown
from ..view_layers import rendered_layers

MARK = "hybrid"  # custom property on our nodes: whether EEVEE draws the shadows


def ray_traced_materials(scene: bpy.types.Scene, layer: bpy.types.ViewLayer | None = None) -> list[bpy.types.Material]:
    """The materials that are ray traced by themselves, of all that a view layer and background scenes may show.

    layer : None for all that the user has rendered.
    """
    flagged = [b_material for b_material in bpy.data.materials if is_traced_by_itself(b_material)]
    if not flagged:
        return []
    there = set[bpy.types.Material | None]()
    for each in rendered_layers(scene) if layer is None else [layer]:
        override = getattr(each, "material_override", None)
        if override:  # all wear that instead
            there.add(override)
        else:
            objects = [*each.objects, *(b_object for b_set in background_sets(scene) for b_object in b_set.objects)]
            there.update(b_material for b_object in objects for _, b_material in shown(b_object))
    return [b_material for b_material in flagged if b_material in there]


def hold_out(depsgraph: bpy.types.Depsgraph, casts: bool) -> None:
    """Hold out what wears those materials, in the depsgraph of a render of the mask layer; let go of all others.

    casts : EEVEE draws their shadows; else the tracer does.
    """
    materials = [b_id for b_id in depsgraph.ids if isinstance(b_id, bpy.types.Material)]
    for b_material in (b_material for b_material in materials if b_material.node_tree is not None):
        wanted = casts if is_traced_by_itself(b_material) else None
        ours = [b_node for b_node in b_material.node_tree.nodes if MARK in b_node]
        if (bool(ours[0][MARK]) if ours else None) == wanted:
            continue  # of an earlier step of motion blur: EEVEE draws it already
        _let_go(b_material.node_tree, ours)
        if wanted is not None:
            _hold_out(b_material, wanted)


def _hold_out(b_material: bpy.types.Material, casts: bool) -> None:
    """To camera rays a Holdout as opaque as what it was; to shadows what it was, or, if it casts none, nothing."""
    tree = b_material.node_tree
    new = partial(_new, tree, casts)
    output = tree.get_output_node("EEVEE") or new("ShaderNodeOutputMaterial")
    holdout, clear = new("ShaderNodeHoldout"), new("ShaderNodeBsdfTransparent")
    held, seen, path = (new(f"ShaderNode{kind}") for kind in ("MixShader", "MixShader", "LightPath"))
    surface = next((link.from_socket for link in output.inputs["Surface"].links), None)
    if surface is not None:
        opaque, number = new("ShaderNodeShaderToRGB"), new("ShaderNodeMath")
        number.operation, number.inputs[1].default_value = "MULTIPLY", 1.0
        tree.links.new(opaque.inputs["Shader"], surface)
        tree.links.new(number.inputs[0], opaque.outputs["Alpha"])
        # Not straight from Alpha: linked so, EEVEE takes any number below 1 for 0 (seen on 5.2).
        tree.links.new(held.inputs[0], number.outputs[0])
    else:
        held.inputs[0].default_value = 1.0
    tree.links.new(held.inputs[1], clear.outputs[0])
    hidden = held
    if b_material.surface_render_method == "DITHERED":
        # What dithering leaves of it is held out whole, as EEVEE itself holds objects out.
        hidden = new("ShaderNodeAddShader")
        tree.links.new(hidden.inputs[0], held.outputs[0])
        tree.links.new(hidden.inputs[1], holdout.outputs[0])
    else:
        tree.links.new(held.inputs[2], holdout.outputs[0])
    other = surface
    if not casts:
        b_material.use_transparent_shadow = True
        unlit = new("ShaderNodeMixShader")
        tree.links.new(unlit.inputs[0], path.outputs["Is Shadow Ray"])
        if surface is not None:
            tree.links.new(unlit.inputs[1], surface)
        tree.links.new(unlit.inputs[2], clear.outputs[0])
        other = unlit.outputs[0]
    tree.links.new(seen.inputs[0], path.outputs["Is Camera Ray"])
    if other is not None:
        tree.links.new(seen.inputs[1], other)
    tree.links.new(seen.inputs[2], hidden.outputs[0])
    tree.links.new(output.inputs["Surface"], seen.outputs[0])


def _new(tree: bpy.types.NodeTree, casts: bool, kind: str) -> bpy.types.Node:
    b_node = tree.nodes.new(kind)
    b_node[MARK] = casts
    return b_node


def _let_go(tree: bpy.types.NodeTree, ours: list[bpy.types.Node]) -> None:
    """Take our nodes away again: with Persistent Data a render meets the copies of the one before."""
    surface = next((b_node.inputs[0].links[0].from_socket for b_node in ours if b_node.type == "SHADERTORGB"), None)
    if surface is not None:
        tree.links.new(tree.get_output_node("EEVEE").inputs["Surface"], surface)
    for b_node in ours:
        tree.nodes.remove(b_node)
