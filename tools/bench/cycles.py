# SPDX-License-Identifier: GPL-3.0-or-later
"""The tracer against Cycles at equal error: a mirror and a glass sphere in a room, over the pixels of the spheres.

Cycles' error is its noise, from two renders with different seeds: RMSE / sqrt(2). Ours is against our own reference.
So neither is charged for the other's model; Cycles is kept inside what a Whitted tracer does, in its favour: point
lights, black world, no diffuse bounces.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Any

import bpy
import numpy as np

import hybrid_addon as hybrid
from hybrid_addon.blender import session
from hybrid_addon.blender.measure import cycles
from hybrid_addon.blender.render.settings import tracer_settings
from hybrid_addon.blender.sync import Translation, translate
from hybrid_addon.measure.error_time import metrics
from hybrid_addon.scene import Settings
from hybrid_addon.tracer import trace

from .measure import Bench, Timing
from .table import Goal, Table

TARGET = 0.005
PILOT = 32  # samples
REFERENCE = 256  # samples: at 16 times fewer the error is 8 times as large
STEPS = (1, 2, 3, 4, 5, 6, 8, 12, 16, 25, 36, 49, 64, 100, 144, 256)
DEPTH = 16
ADAPTIVE, CUTOFF = 0.3, 1 / 16  # at this error nothing finer pays
GOALS = {"the whole frame": 20.0, "the spheres alone": 10.0}
Size = tuple[int, int]


def against_cycles(bench: Bench) -> list[Table]:
    """The tracer against Cycles at equal error, on the whole frame and on the pixels of the spheres alone."""
    size = (128, 96) if bench.quick else (512, 384)
    target = 4 * TARGET if bench.quick else TARGET
    scene = two_spheres(size)
    settings = replace(tracer_settings(scene), max_depth=DEPTH, adaptive=ADAPTIVE, cutoff=CUTOFF)
    scene.view_layers[0].update()
    data = _translated(scene, size).scene
    mask = trace(data, replace(settings, samples=16, adaptive=0.0)).coverage
    region, weight = mask > 0, mask[..., None].astype(np.float64)
    deep = trace(data, replace(settings, samples=REFERENCE, adaptive=0.0, cutoff=1e-4, seed=1), mask).radiance * weight
    samples, ours = _enough(data, settings, mask, deep, target)
    tracer = bench.side_by_side({"ours": partial(_ours, scene, size, replace(settings, samples=samples), mask)})["ours"]

    cycles.whitted_subset(scene, data, DEPTH)
    frame = {"the whole frame": None, "the spheres' rectangle": _box(region), "the spheres alone": _box(region)}
    pixels = np.count_nonzero(region)
    table = Table(
        f"Equal error: RMSE {target:g} over the {pixels:,} pixels of two spheres, {size[0]}x{size[1]}",
        ["", "samples", "RMSE", "wall s", "cpu s", "times ours"],
        note=f"Ours: Noise Threshold {ADAPTIVE:g}, Min Light {CUTOFF:g}; translating, building, tracing "
        "the masked pixels. Cycles: its whole render, transfer of the scene included; 'alone': everything else is held "
        "out within the rectangle around the spheres.",
    )
    table.rows.append(("ours", samples, ours, tracer.wall, tracer.cpu, 1.0))
    for name, box in frame.items():
        if bench.is_over(table):
            break
        _aim(scene, box, size, alone=name.endswith("alone"))
        needed = _needed(scene, region, weight, target)
        bench.say(f"Cycles, {name}: {needed} samples")
        timing, error = _cycles(bench, scene, needed, region, weight)
        ratio = timing.wall / tracer.wall
        table.rows.append((f"Cycles, {name}", needed, error, timing.wall, timing.cpu, ratio))
        if name in GOALS:
            table.goals.append(Goal(f"faster than Cycles on {name}", ratio, GOALS[name], at_least=True))
    return [table]


def _ours(scene: bpy.types.Scene, size: Size, settings: Settings, mask: np.ndarray) -> Any:
    return trace(_translated(scene, size).scene, settings, mask)


def _translated(scene: bpy.types.Scene, size: Size) -> Translation:
    depsgraph = scene.view_layers[0].depsgraph
    return translate(depsgraph, scene, size, (0, 0, *size), light_falloff="PHYSICAL")


def _enough(data: Any, settings: Settings, mask: np.ndarray, deep: np.ndarray, target: float) -> tuple[int, float]:
    """The fewest samples that reach the target, and their error."""
    error = math.inf
    for samples in STEPS:
        film = trace(data, replace(settings, samples=samples), mask)
        error = metrics.rmse(film.radiance * mask[..., None], deep, mask > 0)
        if error <= target:
            return samples, error
    return STEPS[-1], error


def _needed(scene: bpy.types.Scene, region: np.ndarray, weight: np.ndarray, target: float) -> int:
    """Samples for the target: noise falls with their square root."""
    cycles.draw(scene, 1, 0)
    a, b = (cycles.draw(scene, PILOT, seed)[0] * weight for seed in (11, 12))
    return math.ceil(PILOT * (metrics.rmse(a, b, region) / math.sqrt(2) / target) ** 2)


def _cycles(
    bench: Bench, scene: bpy.types.Scene, samples: int, region: np.ndarray, weight: np.ndarray
) -> tuple[Timing, float]:
    """Two renders with other seeds: the time of one, and the error."""
    timing, pictures = Timing(), []
    for seed in (1, 2):
        picture, spent = cycles.draw(scene, samples, seed)
        pictures.append(picture * weight)
        timing.walls.append(spent["wall"])
        timing.cpus.append(spent["cpu"])
        if bench.left < spent["wall"]:
            return timing, math.nan
    return timing, metrics.rmse(pictures[0], pictures[1], region) / math.sqrt(2)


def _aim(scene: bpy.types.Scene, box: tuple[int, int, int, int] | None, size: Size, alone: bool) -> None:
    scene.render.use_border = False
    if box is not None:
        cycles.limit(scene, box, size)
    scene.render.film_transparent = alone
    for b_object in scene.objects:
        b_object.is_holdout = alone and b_object.type == "MESH" and not b_object.hybrid.ray_traced


def _box(region: np.ndarray) -> tuple[int, int, int, int]:
    rows, columns = np.flatnonzero(region.any(axis=1)), np.flatnonzero(region.any(axis=0))
    return int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1


# ------------------------------------------------------------------------------------------------ the scene


def two_spheres(size: Size) -> bpy.types.Scene:
    """A mirror and a glass sphere on a chequered floor in a room of coloured walls, two point lights."""
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    for b_object in list(scene.objects):
        if b_object.type != "CAMERA":
            bpy.data.objects.remove(b_object)
    plane = bpy.ops.mesh.primitive_plane_add
    _wear(plane, (0.8, 0.8, 0.8), size=12, image=_checker())
    _wear(plane, (0.7, 0.2, 0.15), size=12, location=(-4, 0, 6), rotation=(0, math.pi / 2, 0))
    _wear(plane, (0.2, 0.6, 0.2), size=12, location=(4, 0, 6), rotation=(0, -math.pi / 2, 0))
    _wear(plane, (0.4, 0.5, 0.8), size=12, location=(0, 5, 6), rotation=(math.pi / 2, 0, 0))
    for x, values in ((-1.25, {"reflectivity": 1.0, "opacity": 1.0}), (1.25, {"reflectivity": 0.0, "opacity": 0.0})):
        sphere = bpy.ops.mesh.primitive_uv_sphere_add
        b_object = _wear(sphere, (0.8, 0.8, 0.8), radius=1.1, segments=96, ring_count=48, location=(x, 0, 1.1))
        bpy.ops.object.shade_smooth()
        b_object.visible_shadow = False  # Cycles has a black shadow or a caustic where a Whitted tracer tints
        hybrid.mark(b_object, **values, ior=1.5)
    for location, energy in (((-2, -4, 6), 600), ((3, -2, 5), 400)):
        bpy.ops.object.light_add(type="POINT", location=location)
        bpy.context.object.data.energy, bpy.context.object.data.shadow_soft_size = energy, 0.0
    scene.camera.location, scene.camera.rotation_euler = (0, -8, 2.4), (1.42, 0, 0)
    scene.world.color = (0, 0, 0)
    if scene.world.node_tree:
        scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0, 0, 0, 1)
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    session.begin_frame(scene.name)
    return scene


def _wear(operator: Any, color: tuple[float, float, float], image: Any = None, **where: Any) -> bpy.types.Object:
    operator(**where)
    b_material = bpy.data.materials.new("Surface")
    if not b_material.node_tree:
        b_material.use_nodes = True
    b_shader = b_material.node_tree.nodes["Principled BSDF"]
    b_shader.inputs["Base Color"].default_value = (*color, 1)
    b_shader.inputs["Specular IOR Level"].default_value = 0.0
    if image is not None:
        b_image = b_material.node_tree.nodes.new("ShaderNodeTexImage")
        b_image.image, b_image.interpolation = image, "Closest"
        b_material.node_tree.links.new(b_shader.inputs["Base Color"], b_image.outputs["Color"])
    bpy.context.object.data.materials.append(b_material)
    return bpy.context.object


def _checker(squares: int = 24) -> bpy.types.Image:
    b_image = bpy.data.images.new("Checker", squares, squares, float_buffer=True)
    y, x = np.mgrid[:squares, :squares]
    grey = np.where((x + y) % 2, 0.75, 0.1)
    pixels = np.stack([grey, grey, grey, np.ones_like(grey)], axis=-1).astype(np.float32)
    b_image.pixels.foreach_set(pixels.ravel())
    b_image.pack()
    return b_image
