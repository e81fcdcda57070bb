# SPDX-License-Identifier: GPL-3.0-or-later
"""An overlay of viewports: what is ray traced has a color over it, so that one sees it at a glance.

Each mesh goes to the graphics card once and stays there until Blender tells of a change of it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from typing import Any

import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader
from mathutils import Matrix

from ..flags import Flags, is_traced_by_itself

COLOR = (0.25, 0.55, 1.0, 0.35)
"""As the icon's, see-through."""

NEARER = 2e-5
"""By so much of the depth buffer's range the color is drawn in front of the surface that it lies on: rounding differs
between Blender's drawing and ours by a hundredth of it."""

MOST = 5000
"""So many instances are colored at most: each is a call of the graphics card in each redraw."""


SURFACES = {"MESH", "CURVE", "SURFACE", "FONT"}
"""Types of objects that Blender makes triangles of."""

Name = tuple[str, str, tuple[int, ...] | None]
"""Of an object and of its data (geometry nodes may show many data as one object); the material slots whose faces are
ray traced, None for all."""


@dataclass(eq=False)
class _Kept:
    """What was made for the last redraw. places: (batch, matrix), of `edits` and what is shown; batches: by name."""

    key: Any = None
    places: list[tuple[Any, Matrix]] = field(default_factory=list)
    batches: dict[Name, Any] = field(default_factory=dict)


_kept = _Kept()


def touch(b_update: bpy.types.DepsgraphUpdate) -> None:
    """The dependency graph has been told of a change: a mesh that is another one now is read again."""
    if b_update.is_updated_geometry:
        changed = b_update.id.original.name_full
        for name in [name for name in _kept.batches if changed in name]:
            del _kept.batches[name]


def forget() -> None:
    """Another file, or off: let go of everything."""
    _kept.key, _kept.places = None, []
    _kept.batches.clear()


def draw(context: bpy.types.Context, edits: int, shown: frozenset[str] | None) -> None:
    """In a redraw of a viewport, after the scene. edits: a number that differs after each change.

    shown : full names of the objects that the viewport shows; None: all.
    """
    scene = context.scene
    key = (scene.name_full, edits, shown)
    if _kept.key != key:
        _kept.key, _kept.places = key, _placed(context, shown)
    if not _kept.places:
        return
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    view = context.space_data.region_3d.perspective_matrix
    shift = Matrix.Identity(4)
    shift[2] = (0.0, 0.0, 1.0, -NEARER)  # of depth after its division by w
    with gpu.matrix.push_pop(), gpu.matrix.push_pop_projection():
        gpu.matrix.load_projection_matrix(shift @ view)
        gpu.state.depth_test_set("LESS_EQUAL")
        gpu.state.depth_mask_set(False)
        gpu.state.face_culling_set("BACK")
        gpu.state.blend_set("ALPHA")
        shader.uniform_float("color", COLOR)
        for batch, matrix in _kept.places:
            gpu.state.front_facing_set(matrix.is_negative)
            gpu.matrix.load_matrix(matrix)
            batch.draw(shader)
        gpu.state.front_facing_set(False)
        gpu.state.face_culling_set("NONE")
        gpu.state.blend_set("NONE")
        gpu.state.depth_test_set("NONE")


def _placed(context: bpy.types.Context, shown: frozenset[str] | None) -> list[tuple[Any, Matrix]]:
    """Meshes of what is ray traced and where they stand, as the viewport has them."""
    flags, found, used = Flags(context.scene), [], set()
    traced = cache(is_traced_by_itself)
    for instance in context.evaluated_depsgraph_get().object_instances:
        b_object = instance.object
        if b_object.type not in SURFACES or not instance.show_self:
            continue
        owner = instance.parent if instance.is_instance else b_object
        slots = None
        if not (flags.is_ray_traced(b_object) or flags.is_ray_traced(owner)):
            worn = [b_slot.material for b_slot in b_object.material_slots]
            slots = tuple(i for i, b_material in enumerate(worn) if b_material is not None and traced(b_material))
            if not slots:
                continue
        if shown is not None and owner.original.name_full not in shown:
            continue
        name = (b_object.original.name_full, b_object.data.name_full, slots)
        used.add(name)
        batch = _batch(name, b_object)
        if batch is not None:
            found.append((batch, instance.matrix_world.copy()))
        if len(found) == MOST:
            break
    for name in _kept.batches.keys() - used:
        del _kept.batches[name]
    return found


def _batch(name: Name, b_object: bpy.types.Object) -> Any:
    """The triangles of an evaluated object, on the graphics card; None: it has none."""
    if name not in _kept.batches:
        mesh = b_object.to_mesh()
        if mesh is None or len(mesh.loop_triangles) == 0:
            _kept.batches[name] = None
        else:
            triangles = mesh.loop_triangles
            points, corners = np.empty(len(mesh.vertices) * 3, np.float32), np.empty(len(triangles) * 3, np.int32)
            mesh.vertices.foreach_get("co", points)
            triangles.foreach_get("vertices", corners)
            faces = corners.reshape(-1, 3)
            if name[2] is not None:
                worn = np.empty(len(triangles), np.int32)
                triangles.foreach_get("material_index", worn)
                faces = faces[np.isin(worn, name[2])]
            shader = gpu.shader.from_builtin("UNIFORM_COLOR")
            _kept.batches[name] = batch_for_shader(shader, "TRIS", {"pos": points.reshape(-1, 3)}, indices=faces)
        b_object.to_mesh_clear()
    return _kept.batches[name]
