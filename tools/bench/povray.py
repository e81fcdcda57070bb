# SPDX-License-Identifier: GPL-3.0-or-later
"""The tracer against POV-Ray: the same triangles, camera and lights of the Cornell box, as many camera rays."""

from __future__ import annotations

import math
import os
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hybrid_addon.scene import Expression, Instance, PointLight, Scene, Surface, TriangleMesh, World

from . import files
from .measure import Bench, cores
from .table import Goal, Table

DEPTH = 10
CUTOFF = 1 / 255  # POV-Ray's adc_bailout
SKY = (0.3, 0.4, 0.5)
FADE = 0.01  # POV-Ray's lights fall off as 2 / (1 + (d / FADE)^2)


def against_povray(bench: Bench) -> list[Table]:
    """The tracer against POV-Ray on the Cornell box, at 1 and 16 samples a pixel, on all processors."""
    program = shutil.which("povray")
    if program is None:
        raise RuntimeError("povray is not installed (Debian: apt install povray)")
    size = (160, 120) if bench.quick else (1024, 768)
    scene, settings = files.translated("cornell_box", size)
    scene = replace(scene, world=World(SKY))  # its picture of a lake is not POV-Ray's
    table = Table(
        f"Against POV-Ray: Cornell box, {size[0]}x{size[1]}, {DEPTH} bounces, {cores()} threads",
        ["samples", "ours, trace s", "POV-Ray, trace s", "faster", "ours, all s", "POV-Ray, all s", "faster"],
        note="POV-Ray draws 16 samples as 4 x 4 times the pixels, so that both trace as many camera rays, and writes "
        "no picture. All: with building the tree, POV-Ray's with reading its file.",
    )
    with tempfile.TemporaryDirectory() as folder:
        model = Path(folder) / "box.pov"
        model.write_text("\n".join(describe(scene)), encoding="utf-8")
        if "BENCH_KEEP" in os.environ:  # to look at the picture
            shutil.copy(model, os.environ["BENCH_KEEP"])
        for side in (1, 4):
            if bench.is_over(table):
                break
            how = replace(
                settings, samples=side * side, camera_sees="ALL", max_depth=DEPTH, cutoff=CUTOFF, adaptive=0.0
            )
            pov = partial(_povray, program, model, (size[0] * side, size[1] * side))
            timings = bench.side_by_side({"ours": partial(files.traced, scene, how), "povray": pov})
            ours, theirs = timings["ours"], timings["povray"]
            traced = ours.phase("trace"), theirs.phase("trace")
            faster = traced[1] / traced[0]
            row = (side * side, *traced, faster, ours.wall, theirs.wall, theirs.wall / ours.wall)
            table.rows.append(row)
            goal = Goal(f"faster than POV-Ray, {side * side} samples", faster, 1.0, at_least=True)
            table.goals.append(goal)
    return [table]


def _povray(program: str, model: Path, size: tuple[int, int]) -> dict[str, Any]:
    """One run; its own account of the seconds that tracing took."""
    command = [program, f"+I{model}", f"+W{size[0]}", f"+H{size[1]}", f"+WT{cores()}", "-D", "-A", "-F"]
    began = time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True, cwd=model.parent)
    wall = time.perf_counter() - began
    found = re.search(r"Trace Time:.*\(([\d.]+) seconds\)", done.stderr)
    if done.returncode or not found:
        raise RuntimeError(f"povray failed: {done.stderr.strip().splitlines()[-1:]}")
    seconds = float(found[1])
    return {"time": {"trace": {"wall": seconds, "cpu": 0.0}, "total": {"wall": wall, "cpu": 0.0}}}


# ------------------------------------------------------------------------------------------------ for POV-Ray


def describe(scene: Scene) -> Iterator[str]:
    """Scene description, version 3.7. Axes stay Blender's: the camera's own vectors say what is right and up."""
    yield "#version 3.7;"
    yield f"global_settings {{ assumed_gamma 1 max_trace_level {DEPTH} adc_bailout {CUTOFF:.9f} ambient_light rgb 1 }}"
    yield f"background {{ rgb {_vector(SKY)} }}"
    yield _camera(scene)
    for light in scene.lights:
        if not isinstance(light, PointLight):
            raise RuntimeError(f"{light.name}: only point lights are described to POV-Ray")
        color = np.asarray(light.intensity) / math.pi / (2 * FADE * FADE)
        yield (
            f"light_source {{ {_vector(light.position)} rgb {_vector(color)} "
            f"fade_distance {FADE} fade_power 2 {'' if light.cast_shadow else 'shadowless'} }}"
        )
    for instance in scene.instances:
        yield from _mesh(instance, scene.meshes[instance.mesh], scene.surfaces)


def _camera(scene: Scene) -> str:
    camera = scene.camera
    x, y, z, place = (np.asarray(camera.matrix_world)[:3, i] for i in range(4))
    left, right, bottom, top = camera.view_plane
    forward = -z + x * (left + right) / 2 + y * (bottom + top) / 2
    return (
        f"camera {{ perspective location {_vector(place)} direction {_vector(forward)} "
        f"right {_vector(x * (right - left))} up {_vector(y * (top - bottom))} }}"
    )


def _mesh(instance: Instance, mesh: TriangleMesh, surfaces: Sequence[Surface]) -> Iterator[str]:
    matrix = np.asarray(instance.matrix_world)
    points = mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3]
    yield "mesh2 {"
    yield _list("vertex_vectors", points)
    if mesh.normals is not None:
        yield _list("normal_vectors", mesh.normals @ np.linalg.inv(matrix[:3, :3]))
    slots = np.zeros(len(mesh.triangles), int) if mesh.surface_slots is None else mesh.surface_slots
    slots = np.minimum(slots, len(instance.surfaces) - 1)
    yield f"texture_list {{ {len(instance.surfaces)}, "
    yield " ".join(_texture(surfaces[s]) for s in instance.surfaces) + " }"
    yield f"face_indices {{ {len(slots)},"
    yield ",".join(f"<{a},{b},{c}>,{s}" for (a, b, c), s in zip(mesh.triangles, slots, strict=True)) + "}"
    if mesh.normals is not None:
        yield f"normal_indices {{ {len(slots)}, " + ",".join(f"<{a},{b},{c}>" for a, b, c in mesh.corners) + "}"
    ior = next((surfaces[s].ior for s in instance.surfaces if surfaces[s].opacity != 1), 1.0)
    yield f"interior {{ ior {ior} }} }}"


def _texture(surface: Surface) -> str:
    values = (surface.reflectivity, surface.opacity, surface.base_color, surface.emission)
    if any(isinstance(value, Expression) for value in values):
        raise RuntimeError(f"{surface.name}: only plain surfaces are described to POV-Ray")
    r, o, base, emitted = (np.asarray(value, np.float64) for value in values)
    emission = emitted / np.maximum(base, 1e-3)
    ambient = np.asarray(SKY) * surface.ambient
    mirror = f"reflection {{ rgb {r} rgb 1 fresnel on }}" if o < 1 else f"reflection {{ rgb {r} }}"
    mirror = mirror if o < 1 or r > 0 else ""
    return (
        f"texture {{ pigment {{ rgb {_vector(base)} transmit {(1 - o) * (1 - r)} }} finish {{ "
        f"ambient rgb {_vector(ambient * (1 - r) * o)} emission rgb {_vector(emission)} "
        f"diffuse {surface.diffuse * (1 - r) * o} {mirror} }} }}"
    )


def _list(name: str, rows: Any) -> str:
    return f"{name} {{ {len(rows)}, " + ",".join(map(_vector, rows)) + "}"


def _vector(v: Any) -> str:
    return f"<{float(v[0]):.7g},{float(v[1]):.7g},{float(v[2]):.7g}>"
