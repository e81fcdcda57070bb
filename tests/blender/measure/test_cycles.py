# SPDX-License-Identifier: GPL-3.0-or-later
"""The tracer against Cycles of the same file: a renderer that is not ours, on the subset that a Whitted tracer covers.

Cycles is told to stay inside that subset: no diffuse bounces, lights of radius 0, roughness 0, no clamping, no Russian
roulette. The world is black, so only the lights, the mirrors and the glass make the picture. Glass casts no
shadow here: with one light path Cycles has either a black shadow or a caustic where a Whitted tracer tints.
"""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender.render import images

pytestmark = [pytest.mark.blender, pytest.mark.render]

FLAGGED = {"Mirror": (1.0, 1.0, 1.5), "Glass": (0.0, 0.0, 1.5), "Half": (0.5, 0.5, 1.5)}
TOLERANCE = 0.005  # of the object's mean radiance


def nodes_of(name):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    return material, tree, tree.nodes.new("ShaderNodeOutputMaterial")


def shader(tree, kind, **inputs):
    node = tree.nodes.new(f"ShaderNode{kind}")
    for name, value in inputs.items():
        node.inputs[name].default_value = value
    return node


def mix(tree, a, b):
    node = shader(tree, "MixShader", Fac=0.5)
    tree.links.new(node.inputs[1], a.outputs[0])
    tree.links.new(node.inputs[2], b.outputs[0])
    return node


def material(name, kind, color=(0.8, 0.8, 0.8, 1)):
    made, tree, output = nodes_of(name)
    glossy = shader(tree, "BsdfAnisotropic", Roughness=0.0, Color=(1, 1, 1, 1)) if kind in {"mirror", "half"} else None
    glass = shader(tree, "BsdfGlass", Roughness=0.0, IOR=1.5, Color=(1, 1, 1, 1)) if kind in {"glass", "half"} else None
    diffuse = shader(tree, "BsdfDiffuse", Color=color, Roughness=0.0) if kind in {"diffuse", "half"} else None
    surface = {
        "mirror": lambda: glossy,
        "glass": lambda: glass,
        "diffuse": lambda: diffuse,
        "half": lambda: mix(tree, mix(tree, diffuse, glass), glossy),
    }[kind]()
    tree.links.new(output.inputs["Surface"], surface.outputs[0])
    return made


def add(name, made, operator, **where):
    operator(**where)
    b_object = bpy.context.object
    b_object.name = name
    b_object.data.materials.append(made)
    return b_object


def build():
    """Three spheres in an open, left-right different room of diffuse walls, two point lights."""
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    for b_object in list(scene.objects):
        if b_object.type != "CAMERA":
            bpy.data.objects.remove(b_object)
    plane, sphere = bpy.ops.mesh.primitive_plane_add, bpy.ops.mesh.primitive_uv_sphere_add
    add("Floor", material("Grey", "diffuse"), plane, size=12)
    add(
        "Left",
        material("Red", "diffuse", (0.8, 0.1, 0.1, 1)),
        plane,
        size=12,
        location=(-4, 0, 6),
        rotation=(0, 1.5708, 0),
    )
    add(
        "Right",
        material("Green", "diffuse", (0.1, 0.6, 0.1, 1)),
        plane,
        size=12,
        location=(5, 0, 6),
        rotation=(0, -1.5708, 0),
    )
    add(
        "Back",
        material("Blue", "diffuse", (0.3, 0.4, 0.8, 1)),
        plane,
        size=12,
        location=(0, 5, 6),
        rotation=(1.5708, 0, 0),
    )
    for x, (name, values) in zip((-2.2, 0, 2.2), FLAGGED.items(), strict=True):
        made = material(name, name.lower(), (0.7, 0.6, 0.2, 1))
        b_object = add(name, made, sphere, radius=1, segments=64, ring_count=32, location=(x, 0.4 * x, 1.1))
        bpy.ops.object.shade_smooth()
        b_object.visible_shadow = False
        hybrid.mark(b_object, reflectivity=values[0], opacity=values[1], ior=values[2])
    for location, energy in (((-2, -4, 5), 500), ((3, -2, 6), 300)):
        bpy.ops.object.light_add(type="POINT", location=location)
        light = bpy.context.object.data
        light.energy, light.shadow_soft_size = energy, 0.0
    scene.camera.location, scene.camera.rotation_euler = (0.2, -10.5, 2.6), (1.42, 0, 0)
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (0, 0, 0, 1)
    scene.render.resolution_x, scene.render.resolution_y = 112, 64
    scene.hybrid.light_falloff = "PHYSICAL"
    return scene


def cycles_of(scene, samples):
    """The same file through Cycles, within the Whitted subset; (h, w, 4)."""
    engine = scene.render.engine
    scene.render.engine = "CYCLES"
    c = scene.cycles
    c.device, c.samples, c.use_adaptive_sampling, c.use_denoising, c.seed = "CPU", samples, False, False, 7
    c.max_bounces = c.glossy_bounces = c.transmission_bounces = c.transparent_max_bounces = 32
    c.min_light_bounces = c.min_transparent_bounces = 32
    c.diffuse_bounces = c.volume_bounces = 0
    c.blur_glossy = c.sample_clamp_direct = c.sample_clamp_indirect = 0.0
    c.caustics_reflective = c.caustics_refractive = True
    c.pixel_filter_type, c.filter_width = "BOX", 1.0
    scene.hybrid.enabled = False
    bpy.ops.render.render(scene=scene.name)
    picture = next(v for k, v in images.read_render_result(scene).items() if k.endswith("Combined"))
    scene.render.engine = engine
    return picture[..., :3].astype(np.float64)


@pytest.fixture(scope="module")
def pictures(addon):
    scene = build()
    ours = hybrid.render(scene, mode="full", samples=25, max_depth=32).image[..., :3].astype(np.float64)
    return SimpleNamespace(ours=ours, cycles=cycles_of(scene, 196), regions=regions(scene))


def regions(scene):
    """Which pixels each ray traced object fills, without its outline: it alone, white, to the tracer's own camera."""
    found = {}
    for name in FLAGGED:
        for other in scene.objects:
            other.hide_render = other.type == "MESH" and other.name != name
        scene.render.film_transparent = True
        alone = hybrid.render(scene, mode="full", samples=16, max_depth=0).mask
        found[name] = alone == 1
    return found


@pytest.mark.parametrize("name", FLAGGED)
def test_flagged_objects_agree_with_cycles(pictures, name, request):
    """Mean signed error over the object, against the mean radiance there."""
    save(pictures, request)
    region = pictures.regions[name]
    assert region.sum() > 150
    error = (pictures.ours - pictures.cycles)[region].mean()
    assert abs(error) < TOLERANCE * pictures.cycles[region].mean()


@pytest.mark.parametrize("name", FLAGGED)
def test_nothing_is_mirrored(pictures, name):
    """Pixel for pixel our picture is nearer to Cycles' than the picture flipped left to right within the object is."""
    region = pictures.regions[name]
    columns = np.flatnonzero(region.any(axis=0))
    rows = np.flatnonzero(region.any(axis=1))
    box = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    inside = region[box] & region[box][:, ::-1]
    right = np.abs(pictures.ours[box] - pictures.cycles[box])[inside].mean()
    wrong = np.abs(pictures.ours[box][:, ::-1] - pictures.cycles[box])[inside].mean()
    assert right < 0.5 * wrong


def test_the_rest_agrees_too(pictures):
    ray_traced = np.any(list(pictures.regions.values()), axis=0)
    error = (pictures.ours - pictures.cycles)[~ray_traced]
    assert abs(error.mean()) < TOLERANCE * pictures.cycles[~ray_traced].mean()


def save(pictures, request):
    """ours, Cycles' and ten times their difference, for a look: pytest --basetemp=DIR keeps it."""
    folder = Path(request.config._tmp_path_factory.getbasetemp())
    row = np.concatenate([pictures.ours, pictures.cycles, 10 * np.abs(pictures.ours - pictures.cycles)], axis=1)
    images.write_exr(folder / "cycles.exr", row.astype(np.float32))
