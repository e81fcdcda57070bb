# SPDX-License-Identifier: GPL-3.0-or-later
"""The node group that adds EEVEE's half and the traced half."""

from __future__ import annotations

import bpy

GROUP = "Hybrid Composite"
GROUP_MARK = "hybrid_composite"  # custom property: found again after a rename


def composite_group() -> bpy.types.NodeTree:
    """The file's one, made where there is none."""
    found = (group for group in bpy.data.node_groups if group.get(GROUP_MARK) and group.library is None)
    return next(found, None) or _new_group()


def _new_group() -> bpy.types.NodeTree:
    """Raster, Traced -> Image, Alpha: the sum of all four channels, nothing clamped."""
    group = bpy.data.node_groups.new(GROUP, "CompositorNodeTree")
    group[GROUP_MARK] = True
    for name in ("Raster", "Traced"):
        group.interface.new_socket(name, in_out="INPUT", socket_type="NodeSocketColor")
    group.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    group.interface.new_socket("Alpha", in_out="OUTPUT", socket_type="NodeSocketFloat")
    entrance, leave = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    halves = [group.nodes.new("CompositorNodeSeparateColor") for _ in range(2)]
    whole = group.nodes.new("CompositorNodeCombineColor")
    for half, output in zip(halves, entrance.outputs, strict=False):
        group.links.new(half.inputs[0], output)
    for channel in range(4):
        add = group.nodes.new("ShaderNodeMath")
        add.operation = "ADD"
        for term, half in zip(add.inputs, halves, strict=False):
            group.links.new(term, half.outputs[channel])
        group.links.new(whole.inputs[channel], add.outputs[0])
        add.location = (0, 300 - 160 * channel)
    group.links.new(leave.inputs["Image"], whole.outputs[0])
    group.links.new(leave.inputs["Alpha"], add.outputs[0])
    entrance.location, leave.location, whole.location = (-600, 0), (500, 0), (250, 0)
    halves[0].location, halves[1].location = (-350, 150), (-350, -150)
    return group
