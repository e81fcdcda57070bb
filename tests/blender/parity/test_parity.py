# SPDX-License-Identifier: GPL-3.0-or-later
"""Parity: a grey ball on a grey floor under every kind of light and world, by EEVEE and traced, side by side.

The lights stand in the boxes of a black crate, so that one picture holds them all. Their Jitter is on: without it EEVEE
looks for what hides a light in a few steps, and its soft shadows are too bright, whatever draws the rest. How much too
bright the table says with HYBRID_PARITY_JITTER=0.
`pytest -s` prints the table of docs/reference/parity.md.
"""

from __future__ import annotations

import os

import bpy
import numpy as np
import pytest
from mathutils import Vector

import hybrid_addon as hybrid
from tests.blender.kit import empty_scene

pytestmark = [pytest.mark.blender, pytest.mark.render]
CELL, BOXES, SAMPLES = 48, 4, 8  # pixels of a box, boxes across and up
WHERE = Vector((0.5, -0.3, 1.6))  # of a light over its box

LIGHTS = {
    "point": ("POINT", {"shadow_soft_size": 0.0}),
    "point, soft falloff": ("POINT", {"shadow_soft_size": 0.15}),
    "point, a ball": ("POINT", {"shadow_soft_size": 0.15, "use_soft_falloff": False}),
    "spot": ("SPOT", {"shadow_soft_size": 0.0, "spot_size": 1.2, "spot_blend": 0.0}),
    "spot, blend": ("SPOT", {"shadow_soft_size": 0.1, "spot_size": 1.2, "spot_blend": 1.0}),
    "spot, scaled": ("SPOT", {"shadow_soft_size": 0.0, "spot_size": 1.0, "spot_blend": 0.5, "scale": (1.6, 0.8, 1)}),
    "spot, square": ("SPOT", {"shadow_soft_size": 0.0, "spot_size": 1.0, "use_square": True}),
    "area, square": ("AREA", {"shape": "SQUARE", "size": 0.5}),
    "area, rectangle": ("AREA", {"shape": "RECTANGLE", "size": 0.7, "size_y": 0.2}),
    "area, disk": ("AREA", {"shape": "DISK", "size": 0.5}),
    "area, ellipse": ("AREA", {"shape": "ELLIPSE", "size": 0.7, "size_y": 0.25}),
    "area, not normalised": ("AREA", {"shape": "DISK", "size": 0.3, "normalize": False, "energy": 50.0}),
    "exposure, temperature": ("POINT", {"exposure": -1.5, "use_temperature": True, "temperature": 3200.0}),
    "custom distance, no shadow": ("POINT", {"use_custom_distance": True, "cutoff_distance": 2.2, "use_shadow": False}),
    "diffuse factor": ("AREA", {"diffuse_factor": 0.4}),
    "highlight alone": ("AREA", {"specular_factor": 0.6, "visible_diffuse": False, "energy": 40.0}),
}
JITTER = os.environ.get("HYBRID_PARITY_JITTER", "1") != "0"
BOUNDS = {"mean": 0.01, "p99": 0.03, "light": 0.01}
PLASTIC = {"mean": 0.035, "p99": 0.11, "light": 0.025}  # EEVEE rounds its reflectance down to 6 bits, blue to 5
LINKED = {"mean": 0.01, "p99": 0.05, "light": 0.01}  # in boxes of 32 pixels
ROUNDED = {"mean": 0.014, "p99": 0.03, "light": 0.014}  # it rounds the world's light down to 6 bits, blue to 5


def empty(size, width):
    """A black scene, `width` metres of it seen from above in size x size pixels."""
    scene = empty_scene(size, size, SAMPLES)
    scene.eevee.use_shadows = True
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale, camera.location = "ORTHO", width, (0, 0, 10)
    scene.collection.objects.link(camera)
    scene.camera = camera
    return scene


def surface(name, value, roughness=None):
    """A matte material, or, with a roughness, a plastic."""
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    shader = tree.nodes.new("ShaderNodeBsdfDiffuse" if roughness is None else "ShaderNodeBsdfPrincipled")
    shader.inputs[0].default_value = (value, value, value, 1)
    if roughness is not None:
        shader.inputs["Roughness"].default_value = roughness
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return material


def ball_and_floor(x, y, size, material):
    """Both objects."""
    bpy.ops.mesh.primitive_plane_add(size=size, location=(x, y, 0))
    floor = bpy.context.object
    bpy.ops.mesh.primitive_uv_sphere_add(segments=96, ring_count=48, radius=0.4, location=(x, y, 0.4))
    ball = bpy.context.object
    ball.data.shade_smooth()
    for shown in (floor, ball):
        shown.data.materials.append(material)
    return floor, ball


def lamp(kind, x, y, *, scale=(1, 1, 1), visible_diffuse=True, **values):
    light = bpy.data.objects.new(kind, bpy.data.lights.new(kind, kind))
    light.data.energy, light.data.use_shadow_jitter = 10.0, JITTER
    for name, value in values.items():
        setattr(light.data, name, value)
    light.location, light.scale, light.visible_diffuse = Vector((x, y, 0)) + WHERE, scale, visible_diffuse
    light.rotation_euler = (Vector((0, 0, 0.2)) - WHERE).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(light)


def flag_all(scene):
    hybrid.enable(scene)
    for shown in scene.objects:
        if shown.type in ("MESH", "EMPTY"):
            hybrid.mark(shown)
            shown.hybrid.surface = "MATERIAL"


def pictures(scene, mode):
    """(EEVEE's picture, the traced one, where there are no edges), (h, w, 3) and (h, w)."""
    flag_all(scene)
    raster = hybrid.render(scene, mode="raster")
    traced = hybrid.render(scene, mode=mode, samples=SAMPLES, shadow_samples=4)
    hard = hybrid.render(scene, mode="full", samples=SAMPLES, shadow_samples=0)
    assert traced.report["warnings"] == []
    raster, traced, hard = (np.array(result.image)[..., :3].mean(axis=2) for result in (raster, traced, hard))
    penumbra = np.abs(traced - hard) > 0.005 * np.maximum(traced, hard)
    for axis, step in ((0, -2), (0, 2), (1, -2), (1, 2)):  # EEVEE's few samples scatter around it
        penumbra |= np.roll(penumbra, step, axis)
    return raster, traced, off_edges(hard) & ~penumbra


def off_edges(picture):
    """Where no neighbour differs by more than 6 %: outlines, the rims of hard shadows."""
    found = np.ones(picture.shape, bool)
    for axis in (0, 1):
        steep = np.abs(np.diff(np.log(picture + 1e-6), axis=axis)) > 0.06
        before, after = [slice(None)] * 2, [slice(None)] * 2
        before[axis], after[axis] = slice(None, -1), slice(1, None)
        found[tuple(before)] &= ~steep
        found[tuple(after)] &= ~steep
    return found


def compare(name, raster, traced, flat, bounds=BOUNDS):
    """What is beyond bounds: differences off edges as shares of the mean, and of all light; printed for the docs."""
    level, difference = raster.mean(), np.abs(raster - traced)[flat]
    assert level > 0.005, name
    assert flat.mean() > 0.08, name
    found = {
        "mean": float(difference.mean() / level),
        "p99": float(np.percentile(difference, 99) / level),
        "light": float(abs(traced.mean() / level - 1)),
    }
    print(f"| {name} | {found['mean']:.2%} | {found['p99']:.2%} | {found['light']:.2%} |")
    return {name: found} if any(found[key] > bound for key, bound in bounds.items()) else {}


def test_every_kind_of_light(addon):
    scene = empty(CELL * BOXES, 2.0 * BOXES)
    grey, glossy, black = surface("grey", 0.8), surface("glossy", 0.8, 0.5), surface("black", 0.0)
    for k in range(BOXES + 1):
        for place, scale in (((2.0 * k - BOXES, 0, 1.5), (0.06, 8, 3)), ((0, 2.0 * k - BOXES, 1.5), (8, 0.06, 3))):
            bpy.ops.mesh.primitive_cube_add(size=1, location=place)
            bpy.context.object.scale = scale
            bpy.context.object.data.materials.append(black)
    places = [(2.0 * (i % BOXES) - BOXES + 1, 2.0 * (i // BOXES) - BOXES + 1) for i in range(BOXES**2)]
    for (x, y), (name, (kind, values)) in zip(places, LIGHTS.items(), strict=True):
        ball_and_floor(x, y, 1.94, glossy if name == "highlight alone" else grey)
        lamp(kind, x, y, **values)
    raster, traced, flat = pictures(scene, "full")
    wrong = {}
    for i, name in enumerate(LIGHTS):
        x, y = i % BOXES * CELL, i // BOXES * CELL
        box = np.s_[y + 3 : y + CELL - 3, x + 3 : x + CELL - 3]
        bounds = PLASTIC if name == "highlight alone" else BOUNDS
        wrong |= compare(name, raster[box], traced[box], flat[box], bounds)
    assert wrong == {}


def linking(name, objects=(), children=()):
    """A collection for light linking: objects and collections with their switches."""
    collection = bpy.data.collections.new(name)
    for thing, state in objects:
        collection.objects.link(thing)
        list(collection.collection_objects)[-1].light_linking.link_state = state
    for child, state in children:
        collection.children.link(child)
        list(collection.collection_children)[-1].light_linking.link_state = state
    return collection


LINKS = {  # of the light of a box with a floor and a ball: what it lights, and what blocks its light
    "lights the ball alone": lambda floor, ball: (linking("r", [(ball, "INCLUDE")]), None),
    "lights all but the ball": lambda floor, ball: (linking("r", [(ball, "EXCLUDE")]), None),
    "ball casts no shadow": lambda floor, ball: (None, linking("b", [(ball, "EXCLUDE")])),
    "floor alone casts shadows": lambda floor, ball: (None, linking("b", [(floor, "INCLUDE")])),
    "a collection's switch": lambda floor, ball: (
        linking("r", children=[(linking("k", [(ball, "EXCLUDE")], [(linking("d", [(floor, "EXCLUDE")]), "INCLUDE")]),
                                "INCLUDE")]), None
    ),
    "an empty collection": lambda floor, ball: (linking("r"), None),
    "both ways": lambda floor, ball: (
        linking("r", children=[(linking("k", [(ball, "INCLUDE")]), "EXCLUDE")]),
        linking("b", [(floor, "EXCLUDE"), (ball, "INCLUDE")]),
    ),
    "an instance": lambda floor, ball: (linking("r", [(instanced(ball), "EXCLUDE")]), None),
    "what an instance shows": lambda floor, ball: (linking("r", [(instanced(ball) and ball, "EXCLUDE")]), None),
}  # fmt: skip


def instanced(shown):
    """An instance of a collection with the object, in its place."""
    source, place = bpy.data.collections.new("source"), shown.location.copy()
    for collection in list(shown.users_collection):
        collection.objects.unlink(shown)
    source.objects.link(shown)
    shown.location = (0, 0, 0)
    empty = bpy.data.objects.new("instance", None)
    empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", source, place
    bpy.context.scene.collection.objects.link(empty)
    return empty


def test_light_and_shadow_linking(addon):
    scene = empty(32 * 3, 6.0)
    grey = surface("grey", 0.8)
    for (i, (name, build)), strength in zip(enumerate(LINKS.items()), np.linspace(20, 40, 9), strict=True):
        x, y = 2.0 * (i % 3) - 2, 2.0 * (i // 3) - 2
        floor, ball = ball_and_floor(x, y, 1.94, grey)
        lamp("POINT", x, y, shadow_soft_size=0.0, energy=strength)
        linked = bpy.context.scene.objects[f"POINT.{i:03}" if i else "POINT"].light_linking
        linked.receiver_collection, linked.blocker_collection = build(floor, ball)
        floor.name = name
    raster, traced, flat = pictures(scene, "full")
    wrong = {}
    for i, name in enumerate(LINKS):
        x, y = i % 3 * 32, i // 3 * 32
        box = np.s_[y + 2 : y + 30, x + 2 : x + 30]
        wrong |= compare(name, raster[box], traced[box], flat[box], LINKED)
    assert wrong == {}


def environment(scene):
    """A soft sky with three glows, without a pixel over 5."""
    height, width = 32, 64
    latitude = ((np.arange(height) + 0.5) / height * np.pi - np.pi / 2)[:, None]
    longitude = ((0.5 - (np.arange(width) + 0.5) / width) * 2 * np.pi)[None]
    toward = np.stack([np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude)])
    toward = np.concatenate([toward, np.broadcast_to(np.sin(latitude), (1, height, width))])
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = 0.55 + 0.25 * toward[2][..., None]
    for center, color, sharp in (((-0.5, -0.7, 0.5), (2, 1.6, 1.2), 30), ((0.8, -0.4, 0.1), (0.4, 0.8, 1.6), 12)):
        cosine = np.tensordot(np.array(center) / np.linalg.norm(center), toward, 1)
        pixels[..., :3] += np.exp(sharp * (cosine - 1))[..., None] * np.array(color)
    image = bpy.data.images.new("Sky", width, height, float_buffer=True)
    image.pixels.foreach_set(pixels.ravel())
    tree = scene.world.node_tree
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = image
    tree.links.new(node.outputs[0], tree.nodes["Background"].inputs["Color"])


def test_suns_and_worlds(addon):
    """One after the other in one scene; the first in hybrid mode, with a mask and an empty raster."""
    scene = empty(CELL, 2.0)
    ball_and_floor(0, 0, 6, surface("grey", 0.8))
    background = scene.world.node_tree.nodes["Background"].inputs
    lamp("SUN", 0, 0, energy=2.0, angle=0.0)
    lamp("SUN", 0, 0, energy=1.0, angle=0.2)
    bpy.context.scene.objects["SUN.001"].rotation_euler = (0.3, -0.5, 0)
    wrong = compare("sun, sharp and soft", *pictures(scene, "hybrid"))
    for light in list(bpy.data.lights):
        bpy.data.lights.remove(light)
    scene.eevee.use_shadows = False  # a world casts none
    background["Color"].default_value, background["Strength"].default_value = (0.4, 0.6, 0.9, 1), 0.7
    wrong |= compare("world, a colour", *pictures(scene, "full"), ROUNDED)
    environment(scene)
    wrong |= compare("world, an image", *pictures(scene, "full"), ROUNDED)
    assert wrong == {}
