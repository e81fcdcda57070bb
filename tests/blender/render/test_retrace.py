# SPDX-License-Identifier: GPL-3.0-or-later
"""Trace again over what EEVEE drew: the same as a whole render, bit for bit, or a line that says why not."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from hybrid_addon.blender import session
from hybrid_addon.blender.api import HybridError, disable, enable, mark, render
from hybrid_addon.blender.api import retrace as trace_again
from hybrid_addon.blender.errors import TooLarge
from hybrid_addon.blender.pipeline import scene_setup
from hybrid_addon.blender.render import retrace
from hybrid_addon.blender.render.snapshot import Snapshot, digest

pytestmark = pytest.mark.blender


@pytest.fixture
def hybrid(scene):
    """The factory scene with a glass cube on a floor; 48 x 32 pixels."""
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 48, 32, 100
    scene.eevee.taa_render_samples = 2
    scene.eevee.use_shadows = False  # most of the time of software OpenGL
    scene.hybrid.samples = 2
    bpy.ops.mesh.primitive_plane_add(size=12, location=(0, 0, -1))
    bpy.context.object.name = "Floor"
    mark(bpy.data.objects["Cube"], opacity=0.2, ior=1.4)
    enable(scene)
    return scene


def change(_scene):
    bpy.data.objects["Cube"].hybrid.ior = 1.9
    bpy.data.objects["Cube"].hybrid.reflectivity = 0.3


def equal(a, b):
    for name in ("image", "raster", "mask", "traced"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
    assert a.report["rays"] == b.report["rays"] and a.report["settings"] == b.report["settings"]


def structure(scene):
    tree = scene.compositing_node_group if bpy.app.version >= (5, 0) else scene.node_tree
    links = {(a.from_node.name, a.from_socket.name, a.to_node.name, a.to_socket.name) for a in tree.links}
    nodes = {(n.name, n.mute, tuple(s.name for s in n.outputs)) for n in tree.nodes}
    return links, nodes, [(layer.name, layer.use) for layer in scene.view_layers]


def test_a_retrace_equals_a_whole_render(hybrid, monkeypatch):
    first, before = render(hybrid), structure(hybrid)
    change(hybrid)
    settings = {"samples": 3, "max_depth": 2, "cutoff": 0.01, "adaptive": 0.0}
    again = trace_again(hybrid, **settings)
    assert structure(hybrid) == before and not any(own.retracing for own in session.everyone())
    assert again.report["skipped"][0]["what"] == "EEVEE's half of the picture"
    twice = trace_again(hybrid, **settings)
    whole = render(hybrid, **settings)
    equal(again, whole)
    equal(twice, whole)
    assert not np.array_equal(first.image, whole.image)
    assert hybrid.hybrid.samples == 2


def test_a_retrace_goes_through_the_compositor_and_draws_nothing(hybrid):
    tree = hybrid.compositing_node_group if bpy.app.version >= (5, 0) else hybrid.node_tree
    output = next(n for n in tree.nodes if n.type in {"COMPOSITE", "GROUP_OUTPUT"})
    invert = tree.nodes.new("CompositorNodeInvert")
    source = output.inputs[0].links[0].from_socket
    tree.links.new(invert.inputs["Color"], source)
    tree.links.new(output.inputs[0], invert.outputs[0])
    render(hybrid)
    drawn = []

    def evaluated(_scene, depsgraph):
        drawn.append((depsgraph.mode, depsgraph.scene.name))

    bpy.app.handlers.frame_change_post.append(evaluated)
    change(hybrid)
    again = trace_again(hybrid)
    bpy.app.handlers.frame_change_post.remove(evaluated)
    assert [name for mode, name in drawn if mode == "RENDER"] == []  # and of the trace scene others do not hear
    equal(again, render(hybrid))
    assert not np.allclose(again.image, again.raster + again.traced, atol=0.01)


def test_what_eevee_drew_in_a_transparent_film_with_a_border_is_used_again(hybrid):
    hybrid.render.film_transparent = True
    hybrid.render.use_border = True
    hybrid.render.border_min_x, hybrid.render.border_max_x = 0.25, 0.75
    hybrid.frame_set(3)
    hybrid.hybrid.passes = {"DEPTH"}
    render(hybrid)
    change(hybrid)
    again, whole = trace_again(hybrid), render(hybrid)
    equal(again, whole)
    np.testing.assert_array_equal(again.passes["depth"], whole.passes["depth"])


def test_a_frame_of_an_animation_is_retraced_at_its_frame(hybrid):
    cube = bpy.data.objects["Cube"]
    for frame in (1, 5):
        cube.location.x = frame / 4
        cube.keyframe_insert("location", frame=frame)
    hybrid.frame_set(1)
    render(hybrid, frame=4)
    again = trace_again(hybrid, samples=1)
    equal(again, render(hybrid, frame=4, samples=1))
    assert hybrid.frame_current == 1 and again.report["frame"] == 4


def refused(scene, match, **settings):
    with pytest.raises(HybridError, match=match):
        trace_again(scene, **settings)
    assert not any(own.retracing for own in session.everyone())


def flag(_scene):
    bpy.data.objects["Floor"].hybrid.ray_traced = True


def edit_flagged(_scene):
    bpy.data.objects["Cube"].hybrid.ior = 1.3
    bpy.data.objects["Cube"].data.vertices[0].co.x += 0.1


def edit_hidden(scene):
    """What the viewport does not show it does not tell of."""
    floor = bpy.data.objects["Floor"]
    floor.hide_viewport = True
    scene.view_layers[0].update()
    session.of(scene.name).eevee_halves["ViewLayer"].snapshot = Snapshot(scene)
    floor.data.vertices[0].co.z += 0.3


def edit_floor(_scene):
    bpy.data.objects["Floor"].data.vertices[0].co.z = 1
    bpy.data.objects["Floor"].data.update()


CHANGES = {
    "a flag": (flag, "settings"),
    "a place": (lambda s: setattr(bpy.data.objects["Cube"], "location", (0.1, 0, 0)), "'Cube'"),
    "an edit beside a new IOR": (edit_flagged, "'Cube'"),
    "what EEVEE alone draws": (edit_floor, "'Plane'"),
    "an edit of what the viewport hides": (edit_hidden, "'Plane'"),
    "a lamp": (lambda s: setattr(bpy.data.lights[0], "energy", 3.0), "'Light'"),
    "EEVEE's samples": (lambda s: setattr(s.eevee, "taa_render_samples", 3), "settings"),
    "the frame": (lambda s: s.frame_set(7), "frame"),
    "the mode": (lambda s: setattr(s.hybrid, "mode", "FULL"), "chosen objects are traced"),
    "an object gone": (lambda s: bpy.data.objects.remove(bpy.data.objects["Floor"]), "'Floor'|'Plane'"),
    "the world": (lambda s: setattr(s, "world", None), "settings"),
}  # fmt: skip


def test_what_eevee_would_draw_otherwise_is_refused(hybrid):
    refused(hybrid, "press F12 first")
    render(hybrid)
    kept = session.of(hybrid.name).eevee_halves["ViewLayer"]
    assert bpy.ops.hybrid.retrace.poll()
    for name, (edit, reason) in CHANGES.items():
        if name == "the frame":
            assert "frame 1" in (hybrid.frame_set(7), retrace.why_not(hybrid))[1]
            hybrid.frame_set(1)
            continue
        kept.snapshot = Snapshot(hybrid)
        session.of(hybrid.name).eevee_halves = {"ViewLayer": kept}
        assert retrace.why_not(hybrid, thorough=True) == "", name
        edit(hybrid)
        refused(hybrid, reason)
        hybrid.hybrid.mode = "HYBRID"
        bpy.data.objects["Cube"].location.x = 0
        bpy.data.objects.get("Floor") and setattr(bpy.data.objects["Floor"].hybrid, "ray_traced", False)
    disable(hybrid)
    assert not session.of(hybrid.name).eevee_halves


def test_settings_that_change_what_eevee_draws_are_refused(hybrid):
    hybrid.hybrid.raster_backed = False
    render(hybrid)
    refused(hybrid, "Traced Shadows", traced_shadows=False)
    refused(hybrid, "Use EEVEE Pixels", raster_backed=True)
    refused(hybrid, "settings", resolution=(24, 16))
    trace_again(hybrid)


def test_a_compositor_that_shows_more_of_eevee_is_refused(hybrid):
    tree = hybrid.compositing_node_group if bpy.app.version >= (5, 0) else hybrid.node_tree
    hybrid.view_layers[0].use_pass_z = True
    own = next(n for n in tree.nodes if n.type == "R_LAYERS" and n.layer == "ViewLayer")
    viewer = tree.nodes.new("CompositorNodeViewer")
    tree.links.new(viewer.inputs[0], own.outputs["Depth"])
    scene_setup.sync(hybrid)
    render(hybrid)
    refused(hybrid, "uses more of EEVEE")


def test_a_failure_leaves_the_pipeline_as_it_was(hybrid, monkeypatch):
    from hybrid_addon import tracer

    render(hybrid)
    before = structure(hybrid)

    def fails(error):
        def fail(*_args, **_kwargs):
            raise error

        return fail

    halves = session.of(hybrid.name).eevee_halves
    for error, kind, text in (
        (ValueError("no"), HybridError, "^no$"),
        (MemoryError(), TooLarge, "not enough memory"),
        (KeyError("bug"), RuntimeError, "^the ray tracer failed: KeyError: 'bug'$"),
    ):
        session.of(hybrid.name).eevee_halves = halves
        monkeypatch.setattr(tracer, "trace", fails(error))
        with pytest.raises(kind, match=text):
            trace_again(hybrid)
        assert structure(hybrid) == before and not any(own.retracing for own in session.everyone())
    monkeypatch.undo()
    session.of(hybrid.name).error = None
    equal(render(hybrid), trace_again(hybrid))


def test_the_operator_says_why_it_is_greyed_out(hybrid):
    assert not bpy.ops.hybrid.retrace.poll()
    render(hybrid)
    change(hybrid)
    assert bpy.ops.hybrid.retrace.poll()
    assert bpy.ops.hybrid.retrace() == {"FINISHED"} and not any(own.retracing for own in session.everyone())


def test_a_snapshot_knows_what_is_given_to_geometry_nodes(scene):
    cube = bpy.data.objects["Cube"]
    group = bpy.data.node_groups.new("Nodes", "GeometryNodeTree")
    group.interface.new_socket("In", in_out="INPUT", socket_type="NodeSocketGeometry")
    name = group.interface.new_socket("Size", in_out="INPUT", socket_type="NodeSocketFloat").identifier
    modifier = cube.modifiers.new("Nodes", "NODES")
    modifier.node_group = group
    before = Snapshot(scene)
    assert before.reason(scene, thorough=True) == ""
    if hasattr(modifier, "properties"):  # Blender 5.2
        getattr(modifier.properties.inputs, name).value = 2.0
    else:
        modifier[name] = 2.0
    assert "Cube" in before.reason(scene, thorough=True)


def test_a_snapshot_knows_custom_properties_that_materials_may_read(scene):
    b_object = bpy.data.objects["Cube"]
    before = digest(b_object)
    b_object["tint"] = [0.1, 0.2, 0.3]
    after = digest(b_object)
    b_object["tint"][1] = 0.25
    assert len({before, after, digest(b_object)}) == 3
    b_object.hybrid.ior = 1.7
    told = digest(b_object)
    b_object.hybrid.ior = 1.2
    assert told == digest(b_object), "values of ours change nothing that EEVEE draws"
