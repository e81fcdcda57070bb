# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything that the depsgraph shows -> scene instances, meshes and lights.

Curves, surfaces and texts need no code: beside each of them the depsgraph's iterator yields its evaluated geometry as
an object of type MESH, whose parent is the object itself. EEVEE draws the same. Metaballs would, too, but only in the
depsgraph of their own scene, and the render's is another's: they are left out, in previews as well, and warned of.
Hair and points come as what they are, and are made triangles here (`strands`).

Visibility: EEVEE knows an object's visibility to the camera and to shadows. What reflections and refractions see it
does not separate; here an object is left out of them only if both of Cycles' switches (glossy, transmission) are off.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import bpy
import numpy as np

from ...expressions import grid_keys, instance_keys, reads, reads_of_instance
from ...scene import Float64, FogBody, Instance, Light, Medium, TriangleMesh, Visibility, VoxelGrid
from ..flags import Flags
from .attributes import texture_space
from .cache import MeshCache
from .coverage import name_object, name_settings
from .displacement import WORLDLY, Place, Sampler, displaced, keys_of_mesh
from .grids import Grids, smoke_domain, smoke_grids, volume_grids
from .light import LightContext, translate_light
from .likely_to_move import moves
from .linking import Links, linked, links_of
from .material import Surfaces
from .mesh import corner_normals, translate_mesh
from .messages import Warnings
from .object_values import ObjectValues
from .settings import ObjectSettings, instance_settings
from .strands import has_hair, translate_curves, translate_hair, translate_points
from .volume import density_scale, name_fog

MeshKey = tuple[int, frozenset[str], bytes]
Translate = Callable[[bpy.types.Object, frozenset[str], Warnings], TriangleMesh | None]

SHAPES: dict[str, Translate] = {"CURVES": translate_curves, "POINTCLOUD": translate_points}
"""Objects that become triangles here, by their type."""


class Objects:
    """Fills meshes, instances and lights from the depsgraph's instances, one after the other."""

    def __init__(
        self,
        surfaces: Surfaces,
        light_context: LightContext,
        flags: Flags,
        warn: Warnings,
        kept: MeshCache,
        sample: Sampler | None = None,
    ) -> None:
        self._surfaces = surfaces
        self._kept = kept
        self._sample = sample
        self._values = ObjectValues(warn)
        self._moves: dict[str, bool] = {}  # by the object's full name
        self._light_context = light_context
        self._flags = flags
        self._warn = warn
        self._mesh_index: dict[MeshKey, int | None] = {}
        self._parts: dict[tuple[int, frozenset[int], int], int | None] = {}  # of meshes, by the slots that they wear
        self.meshes: list[TriangleMesh] = []
        self.instances: list[Instance] = []
        self.owners: list[str] = []  # of each instance the object whose flag decides
        self.lights: list[Light] = []
        self.fog: list[FogBody] = []  # of what has no surface, but a volume
        self._links: list[Links] = []  # of the lights
        self._names: list[str] = []  # of each instance, by which light linking knows it

    def add_all(
        self,
        b_depsgraph: bpy.types.Depsgraph,
        hair_subdivided: int = 0,
        strands: bool = True,
        shown: frozenset[str] | None = None,
    ) -> None:
        """Add everything visible. What the iterator hands out dies at its next step, so all is copied at once.

        hair_subdivided : `RenderSettings.hair_subdiv` of the artist's scene.   strands : the view layer shows hair.
        shown           : see `translate`.
        """
        for b_instance in b_depsgraph.object_instances:
            if shown is not None and (b_instance.parent or b_instance.object).original.name_full not in shown:
                continue
            if b_instance.show_self and not _is_hidden(b_instance) and (strands or b_instance.object.type != "CURVES"):
                self._add(b_instance)
            if strands and b_instance.show_particles and not _is_hidden(b_instance):
                self._add_hair(b_instance, b_depsgraph.mode == "RENDER", hair_subdivided)
        self.lights = [linked(light, links, self._names) for light, links in zip(self.lights, self._links, strict=True)]

    def _add(self, b_instance: bpy.types.DepsgraphObjectInstance) -> None:
        b_object = b_instance.object
        self._warn_of_missing(b_object)
        if b_object.type == "LIGHT":
            self._add_light(b_instance)
        elif b_object.type == "MESH" and not (b_instance.parent and b_instance.parent.type == "META"):
            self._add_surface(b_instance)
        elif b_object.type in SHAPES:
            self._add_shape(b_instance, SHAPES[b_object.type])
        elif b_object.type == "VOLUME":
            self._add_volume(b_instance, volume_grids(b_object, self._kept, self._warn))
        else:
            name_object(b_object, self._warn)

    def _add_light(self, b_instance: bpy.types.DepsgraphObjectInstance) -> None:
        name_settings(b_instance.object.data, f"light {b_instance.object.name!r}", self._warn)
        light = translate_light(b_instance.object, _matrix(b_instance), self._light_context, self._warn)
        if light is not None:
            self.lights.append(light)
            self._links.append(links_of(b_instance.object))

    def _add_surface(self, b_instance: bpy.types.DepsgraphObjectInstance) -> None:
        b_object = b_instance.object
        if not _has_faces(b_object.data):
            return
        if (b_smoke := smoke_domain(b_object)) is not None:
            self._add_volume(b_instance, smoke_grids(b_object, b_smoke))
            return
        settings = instance_settings(b_instance, self._flags)
        surfaces = self._surfaces_of(b_object, settings)
        self._place(b_instance, settings, surfaces, self._mesh_of(b_instance, surfaces))

    def _add_volume(self, b_instance: bpy.types.DepsgraphObjectInstance, grids: Grids | None) -> None:
        """A box full of what its grids tell, in the first of its materials that has a volume; None: it is empty."""
        b_object = b_instance.object
        name_settings(b_object, f"object {b_object.name!r}", self._warn)
        name_fog(b_object, instance_settings(b_instance, self._flags).ray_traced, self._warn)
        if grids is None:
            return
        medium = self._surfaces.medium_of(b_object, grids.widths, density_scale(b_object, _matrix(b_instance)))
        if medium is not None:
            found = grids.read(grid_keys(*medium.values))
            self._fill(b_instance, grids.box(b_object.name), medium, grids.to_generated, found)

    def _fill(
        self, b_instance: bpy.types.DepsgraphObjectInstance, mesh: TriangleMesh, medium: Medium, to_generated: Float64,
        grids: Mapping[str, VoxelGrid],
    ) -> None:  # fmt: skip
        """A body of fog where an instance is."""
        values = self._values.of(b_instance, instance_keys(*medium.values))
        name, matrix = b_instance.object.name, _matrix(b_instance)
        self.fog.append(FogBody(name, mesh, matrix, medium, grids, to_generated, values))

    def _add_shape(self, b_instance: bpy.types.DepsgraphObjectInstance, translate: Translate) -> None:
        """A curves object, a point cloud: EEVEE draws them by their radius."""
        b_object = b_instance.object
        settings = instance_settings(b_instance, self._flags)
        surfaces = self._surfaces_of(b_object, settings)
        keys = self._keys(surfaces)
        self._warn_of_displacement(b_object, surfaces)
        mesh = self._made(
            (b_object.data.as_pointer(), keys, b""), b_object, partial(translate, b_object, keys, self._warn)
        )
        self._place(b_instance, settings, surfaces, mesh)

    def _add_hair(self, b_instance: bpy.types.DepsgraphObjectInstance, for_render: bool, subdivided: int) -> None:
        b_object = b_instance.object
        for b_modifier in b_object.modifiers:
            if has_hair(b_modifier, for_render):
                settings = instance_settings(b_instance, self._flags)
                surfaces = self._surfaces_of(b_object, settings)
                keys = self._keys(surfaces)
                self._warn_of_displacement(b_object, surfaces)
                make = partial(translate_hair, b_object, b_modifier, for_render, subdivided, keys, self._warn)
                mesh = self._made((b_modifier.as_pointer(), keys, b""), b_object, make)
                self._place(b_instance, settings, surfaces, mesh)

    def _made(self, key: MeshKey, b_object: bpy.types.Object, make: Callable[[], TriangleMesh | None]) -> int | None:
        """Position in `meshes` of what `make` makes, when first asked for, and the last frame's if that is the same."""
        if key not in self._mesh_index:
            mesh = make()
            self._mesh_index[key] = None if mesh is None else len(self.meshes)
            if mesh is not None:
                self.meshes.append(self._kept.mesh((b_object.original.name_full, mesh.name, *key[1:]), mesh))
        return self._mesh_index[key]

    def _place(
        self,
        b_instance: bpy.types.DepsgraphObjectInstance,
        settings: ObjectSettings,
        surfaces: tuple[int, ...],
        mesh: int | None,
    ) -> None:
        """One appearance of a mesh, which is None if it has no face."""
        b_object = b_instance.object
        if mesh is None:
            return
        name_settings(b_object, f"object {b_object.name!r}", self._warn)
        mesh = self._without_fog(b_instance, mesh, surfaces, settings)
        if mesh is None:
            return
        self._warn_of_instancer(b_instance, settings)
        self.owners.append((b_instance.parent or b_object).original.name)
        self._names.append((b_instance.parent or b_object).original.name_full)
        self.instances.append(
            Instance(
                name=b_object.name,
                mesh=mesh,
                matrix_world=_matrix(b_instance),
                surfaces=surfaces,
                ray_traced=settings.ray_traced,
                visibility=_visibility(b_object),
                moves=self._is_likely_to_move(b_instance, mesh),
                values=self._values.of(b_instance, self._read_of_instance(surfaces)),
            )
        )

    def _without_fog(
        self,
        b_instance: bpy.types.DepsgraphObjectInstance,
        mesh: int,
        surfaces: tuple[int, ...],
        settings: ObjectSettings,
    ) -> int | None:
        """What is left of a mesh, None if nothing is, when the faces are gone that bound a volume and have no surface.

        Each such material slot is a body of fog, as in EEVEE.
        """
        media = {slot: self._surfaces.surfaces[index].fog for slot, index in enumerate(surfaces)}
        solid = frozenset(slot for slot, medium in media.items() if medium is None)
        if len(solid) == len(surfaces):
            return mesh
        b_object, rest = b_instance.object, self._part(b_instance, mesh, solid, len(surfaces))
        if rest is None:
            name_fog(b_object, settings.ray_traced, self._warn)
        for slot, medium in media.items():
            part = None if medium is None else self._part(b_instance, mesh, frozenset([slot]), len(surfaces))
            if part is not None and medium is not None:
                self._fill(b_instance, self.meshes[part], medium, texture_space(b_object.data), {})
        return rest

    def _part(
        self, b_instance: bpy.types.DepsgraphObjectInstance, mesh: int, slots: frozenset[int], count: int
    ) -> int | None:
        """Position in `meshes` of the triangles that wear these of `count` material slots; None: none does."""
        key = (mesh, slots, count)
        if key not in self._parts:
            whole = self.meshes[mesh]
            worn = np.zeros(len(whole.triangles), np.int32) if whole.surface_slots is None else whole.surface_slots
            kept = np.isin(np.minimum(worn, count - 1), sorted(slots))
            self._parts[key] = mesh if kept.all() else None
            if kept.any() and not kept.all():
                part = replace(
                    whole, triangles=whole.triangles[kept], corners=whole.corners[kept], surface_slots=worn[kept]
                )
                name = b_instance.object.original.name_full
                self._parts[key] = len(self.meshes)
                self.meshes.append(self._kept.mesh((name, whole.name, slots, count), part))
        return self._parts[key]

    def _is_likely_to_move(self, b_instance: bpy.types.DepsgraphObjectInstance, mesh: int) -> bool:
        b_object = b_instance.object
        for b_owner in filter(None, (b_object, b_instance.parent)):
            name = b_owner.original.name_full
            if name not in self._moves:
                self._moves[name] = moves(b_owner)
            if self._moves[name]:
                return True
        return self._kept.has_moved(b_object.original.name_full, self.meshes[mesh], _matrix(b_instance))

    def _surfaces_of(self, b_object: bpy.types.Object, settings: ObjectSettings) -> tuple[int, ...]:
        """One for each material slot, and at least one. An evaluated object's slots include its mesh's own."""
        b_materials = [b_slot.material for b_slot in b_object.material_slots] or [None]
        return tuple(self._surfaces.index_of(b_material, settings.custom) for b_material in b_materials)

    def _mesh_of(self, b_instance: bpy.types.DepsgraphObjectInstance, surfaces: tuple[int, ...]) -> int | None:
        """Position in `meshes` of the object's evaluated mesh, translated when first met; None if it has no face."""
        b_object, keys = b_instance.object, self._keys(surfaces)
        # Objects may share one evaluated mesh, which outlives this loop; displaced it depends on its own place.
        moves = [self._surfaces.moves[index] for index in surfaces]
        place, state = None, b""
        if keys & WORLDLY or any(move is not None for move in moves):
            values = self._values.of(b_instance, instance_keys(*moves))
            place = Place(_matrix(b_instance), self._surfaces.frame, values, self._sample)
            state = place.matrix.tobytes() + repr(values).encode()
        key = (b_object.data.as_pointer(), keys, state)
        return self._made(key, b_object, partial(self._translated, b_object, keys, moves, place))

    def _keys(self, surfaces: tuple[int, ...]) -> frozenset[str]:
        return frozenset(key for index in surfaces for key in reads(self._surfaces.surfaces[index]))

    def _read_of_instance(self, surfaces: tuple[int, ...]) -> frozenset[str]:
        return frozenset(key for index in surfaces for key in reads_of_instance(self._surfaces.surfaces[index]))

    def _translated(
        self, b_object: bpy.types.Object, keys: frozenset[str], moves: list[Any], place: Place | None
    ) -> TriangleMesh | None:
        b_mesh = b_object.to_mesh() if b_object.data.is_editmode else b_object.data
        normals = None if place is None else corner_normals(b_mesh)
        scratch = partial(_scratch, b_object, b_mesh)
        mesh = translate_mesh(b_mesh, b_object.name, keys_of_mesh(keys), self._warn, scratch)
        b_object.to_mesh_clear()
        if mesh is None or place is None or normals is None:
            return mesh
        return displaced(mesh, normals, moves, keys, place)

    # -------------------------------------------------------------------------------------------- warnings

    def _warn_of_missing(self, b_object: bpy.types.Object) -> None:
        for b_id in (b_object.original, b_object.original.data, b_object.original.instance_collection):
            if b_id is not None and b_id.is_missing:
                library = b_id.library.filepath if b_id.library else "its library"
                self._warn.add(f"object {b_object.name!r}: {b_id.name!r} is missing from {library}")

    def _warn_of_displacement(self, b_object: bpy.types.Object, surfaces: tuple[int, ...]) -> None:
        if any(self._surfaces.moves[index] is not None for index in surfaces):
            self._warn.add(f"object {b_object.name!r}: its hair, curves or points are not displaced")

    def _warn_of_instancer(self, b_instance: bpy.types.DepsgraphObjectInstance, settings: ObjectSettings) -> None:
        if self._flags.is_ray_traced(b_instance.object) and not settings.ray_traced:
            shown, by = b_instance.object.name, b_instance.parent.name
            self._warn.add(f"object {shown!r}: shown by {by!r}, which is not ray traced: tick {by!r} instead")


def _scratch(b_object: bpy.types.Object, b_mesh: bpy.types.Mesh) -> bpy.types.Mesh:
    """A copy of the object's mesh, until `to_mesh_clear`; `b_mesh` itself if that is one."""
    return b_mesh if b_object.data.is_editmode else b_object.to_mesh()


def _is_hidden(b_instance: bpy.types.DepsgraphObjectInstance) -> bool:
    """Hidden objects may still be instanced, on purpose, by others: collections, particles and geometry nodes."""
    b_parent = b_instance.parent
    own = b_parent is None or b_parent.original == b_instance.object.original
    return own and b_instance.object.hide_render


def _has_faces(b_mesh: bpy.types.Mesh) -> bool:
    return b_mesh.is_editmode or len(b_mesh.polygons) > 0


def _matrix(b_instance: bpy.types.DepsgraphObjectInstance) -> Float64:
    return np.array(b_instance.matrix_world, dtype=np.float64)


def _visibility(b_object: bpy.types.Object) -> Visibility:
    return Visibility(
        camera=b_object.visible_camera,
        shadow=b_object.visible_shadow,
        raycast=getattr(b_object, "visible_raycast", True),  # of 5.2
        secondary=b_object.visible_glossy or b_object.visible_transmission,
    )
