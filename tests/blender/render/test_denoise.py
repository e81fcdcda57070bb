# SPDX-License-Identifier: GPL-3.0-or-later
"""Denoise in a render: who finds the library, what the report says, and that motion blur and layers go with it."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender.render.settings import find_denoiser, preview_settings, tracer_settings
from hybrid_addon.tracer.film import denoiser
from tests.blender.kit import nodes_of

pytestmark = pytest.mark.blender


@pytest.fixture
def frosted(scene):
    """The factory's cube, as rough metal, and a bright panel; the ray tracer draws all of the picture."""
    cube = bpy.data.objects["Cube"]
    shader = next(n for n in cube.data.materials[0].node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    shader.inputs["Metallic"].default_value, shader.inputs["Roughness"].default_value = 1.0, 0.4
    hybrid.mark(cube)
    bpy.ops.mesh.primitive_plane_add(size=3, location=(3, -1, 2), rotation=(0, 1.2, 0))
    bpy.context.object.data.materials.append(glow := bpy.data.materials.new("glow"))
    nodes = nodes_of(glow).nodes
    nodes.clear()
    lamp, end = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeOutputMaterial")
    glow.node_tree.links.new(lamp.outputs[0], end.inputs[0])
    lamp.inputs["Strength"].default_value = 8.0
    bpy.context.object.visible_camera = False
    scene.render.resolution_x, scene.render.resolution_y = 40, 30
    scene.hybrid.mode, scene.hybrid.adaptive = "FULL", 0.0
    return scene


def test_blender_brings_the_library():
    find_denoiser()
    with denoiser.Denoiser(1) as work:
        assert work.version


def test_it_arrives_in_the_tracer_and_not_in_the_preview(frosted):
    assert not tracer_settings(frosted).denoise
    frosted.hybrid.denoise = True
    assert tracer_settings(frosted).denoise and not preview_settings(frosted).denoise


@pytest.mark.parametrize("moves", [False, True])
def test_a_render_is_denoised_and_the_report_counts_the_pixels(frosted, moves):
    if moves:
        frosted.render.use_motion_blur = True
        cube = bpy.data.objects["Cube"]
        for frame, x in ((0, -0.3), (2, 0.3)):
            cube.location.x = x
            cube.keyframe_insert("location", frame=frame)
    plain = hybrid.render(frosted, frame=1, samples=4)
    clean = hybrid.render(frosted, frame=1, samples=4, denoise=True)
    assert plain.report["denoising"] == {}
    done = clean.report["denoising"]
    changed = (clean.image != plain.image).any(axis=2)
    assert done["pixels"] == np.count_nonzero(changed) > 100 and done["wall"] > 0
    assert not any("denoise" in warning for warning in clean.report["warnings"])
    edges = [np.abs(np.diff(r.image[..., :3], axis=1)).mean() for r in (plain, clean)]
    assert edges[1] < 0.9 * edges[0]


def test_without_the_library_there_is_one_warning_and_the_picture_as_it_is(frosted, monkeypatch):
    plain = hybrid.render(frosted, samples=2)
    find_denoiser()
    monkeypatch.setattr(denoiser, "_loaded", [None])
    found = hybrid.render(frosted, samples=2, denoise=True)
    assert [w for w in found.report["warnings"] if "denoise" in w.lower()] == [
        "not denoised: Open Image Denoise 2, which Blender ships, was not found"
    ]
    assert np.array_equal(found.image, plain.image)
