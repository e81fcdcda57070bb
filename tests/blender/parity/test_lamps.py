# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps in smooth and rough surfaces, against EEVEE and Cycles: shapes, radiances, highlights.

Boxes of one picture, each with a lamp of its own that lights nothing else. `pytest -s` prints the tables in docs.
"""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from mathutils import Vector

import hybrid_addon as hybrid
from tests.blender.parity.test_parity import empty, off_edges

pytestmark = [pytest.mark.blender, pytest.mark.render]
CELL, SAMPLES = 64, 16

KINDS = {  # two sizes of each
    "square": ("AREA", [{"shape": "SQUARE", "size": 1.0}, {"shape": "SQUARE", "size": 0.4}]),
    "rectangle": ("AREA", [{"shape": "RECTANGLE", "size": s, "size_y": s / 4} for s in (1.3, 0.8)]),
    "disk": ("AREA", [{"shape": "DISK", "size": 1.0}, {"shape": "DISK", "size": 0.4}]),
    "ellipse": ("AREA", [{"shape": "ELLIPSE", "size": s, "size_y": s / 2} for s in (1.3, 0.6)]),
    "point": ("POINT", [{"shadow_soft_size": 0.5}, {"shadow_soft_size": 0.2}]),
    "point, a ball": ("POINT", [{"shadow_soft_size": r, "use_soft_falloff": False} for r in (0.5, 0.2)]),
    "spot": ("SPOT", [{"shadow_soft_size": r, "spot_size": 2.5, "spot_blend": 0.0} for r in (0.5, 0.2)]),
    "sun": ("SUN", [{"angle": 0.5}, {"angle": 0.2}]),
}
ROUGHNESS = (0.05, 0.1, 0.2, 0.3, 0.5)


def metal_or_glass(name, roughness, transmission=0.0):
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    inputs = material.node_tree.nodes["Principled BSDF"].inputs
    inputs["Base Color"].default_value = (1, 1, 1, 1)
    inputs["Metallic"].default_value, inputs["Transmission Weight"].default_value = 1 - transmission, transmission
    inputs["Roughness"].default_value, inputs["IOR"].default_value = roughness, 1.5
    return material


def plane(x, y):
    bpy.ops.mesh.primitive_plane_add(size=1.9, location=(x, y, 0))
    return bpy.context.object


def dome(x, y, radius=4.0, steps=48):
    """A part of a large ball, as wide as the plane."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=steps, y_subdivisions=steps, size=1.9, location=(x, y, 0))
    mesh = bpy.context.object.data
    for vertex in mesh.vertices:
        vertex.co.z = (radius**2 - vertex.co.x**2 - vertex.co.y**2) ** 0.5 - radius
    mesh.shade_smooth()
    return bpy.context.object


def ball(x, y):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=128, ring_count=64, radius=0.9, location=(x, y, 0))
    bpy.context.object.data.shade_smooth()
    return bpy.context.object


def lamp(kind, values, place, target, lights):
    """A lamp that no window of EEVEE's dims, that cameras do not see, and that lights one object; nothing is before it,
    and shadows would be most of EEVEE's work."""
    light = bpy.data.objects.new(kind, bpy.data.lights.new(kind, kind))
    light.data.use_shadow = False
    light.data.energy = 3.0 if kind == "SUN" else 60.0
    if kind != "SUN":
        light.data.use_custom_distance, light.data.cutoff_distance = True, 1000.0
    for name, value in values.items():
        setattr(light.data, name, value)
    light.location, light.visible_camera = place, False
    light.rotation_euler = (Vector(target) - Vector(place)).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(light)
    linked = bpy.data.collections.new("lit")
    linked.objects.link(lights)
    light.light_linking.receiver_collection = linked
    return light


def engine_picture(scene, engine, samples):
    """(h, w) of what an engine of Blender's draws."""
    hybrid.disable(scene)
    before, scene.render.engine = scene.render.engine, engine
    if engine == "CYCLES":
        scene.cycles.device, scene.cycles.samples, scene.cycles.use_denoising = "CPU", samples, False
        scene.cycles.use_adaptive_sampling, scene.cycles.sample_clamp_indirect = False, 0.0
        scene.cycles.blur_glossy = 0.0
    else:
        scene.eevee.taa_render_samples = samples
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    path = bpy.app.tempdir + f"{engine}.exr"
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)
    scene.render.engine = before
    image = bpy.data.images.load(path)
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(image.size[1], image.size[0], -1)[..., :3].mean(axis=2)
    bpy.data.images.remove(image)
    return pixels


def traced_picture(scene, **settings):
    hybrid.enable(scene)
    for shown in scene.objects:
        if shown.type == "MESH":
            hybrid.mark(shown)
            shown.hybrid.surface = "MATERIAL"
    scene.hybrid.adaptive = 0.0
    for name, value in settings.items():
        setattr(scene.hybrid, name, value)
    return np.array(hybrid.render(scene, mode="full").image)[..., :3].mean(axis=2)


def boxes(count):
    """Their middles in a square picture, and their pixels."""
    across = int(np.ceil(np.sqrt(count)))
    places = [(2.0 * (k % across) - across + 1, 2.0 * (k // across) - across + 1) for k in range(count)]
    cells = [np.s_[k // across * CELL : (k // across + 1) * CELL, k % across * CELL : (k % across + 1) * CELL]
             for k in range(count)]  # fmt: skip
    return across, places, cells


WAYS = {  # what shows the lamp: how it is made, of what, where the lamp is and where it looks, and against whom
    "flat mirror": (plane, 0.0, (0.1, -0.05, 3.0), ("EEVEE", "Cycles")),
    "curved mirror": (dome, 0.0, (0.1, -0.05, 1.2), ("EEVEE", "Cycles")),
    "through a glass ball": (ball, 1.0, (0.05, 0.1, -2.5), ("Cycles",)),
}


@pytest.mark.parametrize("way", WAYS)
def test_lamps_have_their_shape_and_radiance(addon, way):
    build, transmission, offset, others = WAYS[way]
    lamps = [(name, kind, values) for name, (kind, both) in KINDS.items() for values in both]
    if build is plane:  # seen from infinitely far it mirrors one direction: all of a sun, or nothing
        lamps = [found for found in lamps if found[1] != "SUN"]
    across, places, cells = boxes(len(lamps))
    scene = empty(CELL * across, 2.0 * across)
    scene.eevee.use_shadows = False  # most of the time of software OpenGL
    material = metal_or_glass("smooth", 0.0, transmission)
    for (x, y), (_, kind, values) in zip(places, lamps, strict=True):
        shown = build(x, y)
        shown.data.materials.append(material)
        lamp(kind, values, (x + offset[0], y + offset[1], offset[2]), (x, y, 0), shown)
    ours = traced_picture(scene, samples=SAMPLES, light_falloff="EEVEE")
    found = {"EEVEE": ("EEVEE", SAMPLES), "Cycles": ("CYCLES", 128)}
    wrong = []
    for other in others:
        engine, samples = found[other]
        theirs = engine_picture(scene, scene.render.engine if engine == "EEVEE" else engine, samples)
        for (name, _, _), cell in zip(lamps, cells, strict=True):
            a, b = ours[cell], theirs[cell]
            least = 0.4 * np.percentile(b, 99.5)
            lit = [a > least, b > least]
            overlap = (lit[0] & lit[1]).sum() / max((lit[0] | lit[1]).sum(), 1)
            light = abs(a.sum() / b.sum() - 1)
            print(f"| {way} | {name} | {other} | {overlap:.2f} | {light:.1%} |")
            if not (overlap >= 0.9 and light <= 0.03):
                wrong.append((name, other, overlap, light))
    assert wrong == []


LOBES = {
    "square": ("AREA", {"shape": "SQUARE", "size": 0.8}),
    "ellipse": ("AREA", {"shape": "ELLIPSE", "size": 1.0, "size_y": 0.4}),
    "point, a ball": ("POINT", {"shadow_soft_size": 0.3, "use_soft_falloff": False}),
    "sun": ("SUN", {"angle": 0.3}),
}


def test_highlights_are_those_of_eevee(addon):
    """Alone: off edges, as shares of the mean."""
    lamps = [(name, r) for r in ROUGHNESS for name in LOBES]
    across, places, cells = boxes(len(lamps))
    scene = empty(CELL * across, 2.0 * across)
    scene.eevee.use_shadows = False  # most of the time of software OpenGL
    for (x, y), (name, roughness) in zip(places, lamps, strict=True):
        shown = ball(x, y)
        shown.data.materials.append(metal_or_glass(f"metal {roughness}", roughness))
        kind, values = LOBES[name]
        lamp(kind, values, (x + 0.9, y + 0.5, 1.4), (x, y, 0), shown)
    ours = traced_picture(scene, samples=SAMPLES // 2, max_depth=0)
    theirs = engine_picture(scene, scene.render.engine, SAMPLES // 2)
    wrong = []
    for (name, roughness), cell in zip(lamps, cells, strict=True):
        a, b = ours[cell], theirs[cell]
        flat = off_edges(a)
        difference = np.abs(a - b)[flat] / b.mean()
        mean, p99, light = difference.mean(), np.percentile(difference, 99), abs(a.sum() / b.sum() - 1)
        print(f"| {name} | {roughness} | {mean:.2%} | {p99:.2%} | {light:.2%} |")
        if not (flat.mean() > 0.2 and mean <= 0.02 and p99 <= 0.05 and light <= 0.03):
            wrong.append((name, roughness, mean, p99, light))
    assert wrong == []
