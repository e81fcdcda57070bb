# SPDX-License-Identifier: GPL-3.0-or-later
"""The trace scene's passes for compositors, beside EEVEE's own of the same picture, and Cryptomatte."""

from __future__ import annotations

from types import SimpleNamespace

import bpy
import numpy as np
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender.pipeline import nodes, scene_setup
from hybrid_addon.blender.render import images

pytestmark = [pytest.mark.blender, pytest.mark.render]


def sockets(scene):
    """The outputs of the node that shows the ray traced half."""
    node = next(n for n in nodes.compositor_tree(scene).nodes if nodes.role(n) == "trace")
    return {output.name for output in node.outputs if output.enabled}


@pytest.fixture(scope="module")
def rendered(addon):
    """A ray traced cube and smooth sphere before a floor; the file is multilayer EXR, so EEVEE draws all."""
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y, scene.eevee.taa_render_samples = 96, 72, 8
    scene.eevee.use_shadows = False  # most of the time of software OpenGL
    bpy.ops.mesh.primitive_plane_add(size=30, location=(0, 0, -1))
    bpy.ops.mesh.primitive_uv_sphere_add(radius=1, location=(2.2, -1.5, 0))
    bpy.ops.object.shade_smooth()
    hybrid.mark(bpy.context.object, opacity=0.0)
    hybrid.mark(bpy.data.objects["Cube"], reflectivity=1.0)
    layer = scene.view_layers[0]
    layer.use_pass_z = layer.use_pass_normal = layer.use_pass_cryptomatte_object = True
    scene.hybrid.traced_shadows, scene.hybrid.adaptive = "OFF", 0.0
    hybrid.enable(scene)
    r = SimpleNamespace(before=sockets(scene))
    scene.hybrid.passes = {"DEPTH", "NORMAL", "SAMPLES"}
    r.wanted = sockets(scene)
    image = scene.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "MULTI_LAYER_IMAGE"
    image.file_format = "OPEN_EXR_MULTILAYER"
    scene_setup.sync(scene)
    r.mask = hybrid.render(scene, samples=4).mask
    r.eevee = {k.removeprefix(layer.name + "."): v for k, v in images.read_render_result(scene).items()}
    traced = images.read_render_result(scene_setup.trace_scene(scene))
    r.ours = {k.partition(".")[2]: v for k, v in traced.items()}
    scene.hybrid.passes = set()
    r.after = sockets(scene)
    return r


def test_the_node_has_the_sockets_that_were_asked_for(rendered):
    assert rendered.before == rendered.after == {"Image", "Alpha", "Mask", "Residual", "Raster", "Traced"}
    assert rendered.wanted == rendered.before | {"Depth", "Normal", "Samples"}


def test_depth_is_eevees_own(rendered):
    inside = rendered.mask > 0.99
    ours, eevee = rendered.ours["Depth"][inside, 0], rendered.eevee["Depth"][inside, 0]
    off = np.abs(ours - eevee) / eevee
    assert np.median(off) < 0.004  # EEVEE takes the sample nearest to the pixel's centre, the tracer the centre
    assert np.quantile(off, 0.9) < 0.02
    assert (rendered.ours["Depth"][rendered.mask == 0] == np.float32(1e10)).all()


def test_normals_are_eevees_own(rendered):
    inside = rendered.mask > 0.99
    off = np.abs(rendered.ours["Normal"] - rendered.eevee["Normal"])[inside].max(axis=-1)
    assert np.median(off) < 0.04
    assert np.quantile(off, 0.9) < 0.12


def test_samples_are_where_the_mask_is(rendered):
    np.testing.assert_array_equal(rendered.ours["Samples"][..., 0] >= 4, rendered.mask > 0)


def test_cryptomatte_of_the_flagged_objects_is_their_mask(rendered):
    levels = [rendered.eevee[name] for name in sorted(rendered.eevee) if name.startswith("CryptoObject")]
    ids = np.concatenate([level[..., 0::2] for level in levels], axis=-1).view(np.uint32)
    coverage = np.concatenate([level[..., 1::2] for level in levels], axis=-1)
    ray_traced = np.unique(ids[..., 0][rendered.mask > 0.999])
    assert len(ray_traced) == 2
    matte = np.where(np.isin(ids, ray_traced), coverage, 0).sum(axis=-1)
    off = np.abs(matte - rendered.mask)
    assert off.mean() < 0.005, off.mean()
    assert off.max() < 0.2, off.max()  # EEVEE gives Cryptomatte no pixel filter
