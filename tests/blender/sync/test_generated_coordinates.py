# SPDX-License-Identifier: GPL-3.0-or-later
"""Generated coordinates are EEVEE's: over the texture space, before modifiers deform, half way where a mesh is flat."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

import hybrid_addon as hybrid

pytestmark = [pytest.mark.blender, pytest.mark.render]


def coordinates():
    """A material that glows in its Generated coordinates."""
    material = bpy.data.materials.new("coordinates")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    glow, source = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeTexCoord")
    links.new(source.outputs["Generated"], glow.inputs["Color"])
    links.new(glow.outputs[0], nodes["Material Output"].inputs["Surface"])
    return material


def test_generated_coordinates_are_eevees(addon):
    bpy.ops.wm.read_factory_settings()
    scene, material = bpy.context.scene, coordinates()
    bpy.data.objects.remove(bpy.data.objects["Cube"])

    def add(operator, x, **values):
        operator(location=(x, 0, 0), **values)
        bpy.context.object.data.materials.append(material)
        hybrid.mark(bpy.context.object)
        return bpy.context.object

    add(bpy.ops.mesh.primitive_plane_add, -8, size=2.5)
    add(bpy.ops.mesh.primitive_cube_add, -4.7).modifiers.new("Round", "SUBSURF").render_levels = 3
    bent = add(bpy.ops.mesh.primitive_uv_sphere_add, -1.4).modifiers.new("Bend", "SIMPLE_DEFORM")
    bent.deform_method, bent.angle = "BEND", 1.5
    own = add(bpy.ops.mesh.primitive_cube_add, 2).data
    own.use_auto_texspace, own.texspace_location, own.texspace_size = False, (0.3, 0.2, 0.1), (2, 1.5, 0.7)
    add(bpy.ops.object.text_add, 4).data.extrude = 0.2
    add(bpy.ops.curve.primitive_bezier_circle_add, 9).data.bevel_depth = 0.3
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 22
    scene.camera.location, scene.camera.rotation_euler = (1, -10, 8), (0.9, 0, 0)
    (scene.render.resolution_x, scene.render.resolution_y), scene.eevee.taa_render_samples = (160, 40), 1
    scene.eevee.use_shadows = False  # most of the time of software OpenGL
    hybrid.enable(scene)
    ours, eevee = (hybrid.render(scene, mode=mode, samples=1).image[..., :3] for mode in ("full", "raster"))
    difference = np.abs(ours - eevee).max(axis=-1)
    assert 0.05 < (eevee.max(axis=-1) > 0.1).mean() < 0.5
    assert np.mean(difference > 0.01) < 0.002  # but for pixels on outlines
