# SPDX-License-Identifier: GPL-3.0-or-later
"""What EEVEE draws of a scene, as far as an edit could change it: taken before a render, compared before a retrace.

The dependency graph tells which datablocks have been touched since, but not by what: a value of ours counts as a change
of the shape. So what can be touched by our values, and what a depsgraph may not tell of (it has not looked for a
while, or its view layer does not show it), is remembered by a digest of all other values it has: objects, their data,
materials, the world. The touch of anything else is a change.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from functools import cache
from typing import Any

import bpy
import numpy as np

from ..instancing import node_inputs
from ..pipeline import scene_setup, trace_scenes
from ..sync.attributes import FIELDS
from ..sync.object_values import rgba_in

OURS = "hybrid"
SKIPPED = {
    "rna_type", OURS, "animation_data", "bl_idname", "preview", "id_data", "original", "select", "is_evaluated",
    "users", "tag", "is_runtime_data", "session_uid", "bound_box", "is_updated", "is_updated_data", "mode",
    "show_expanded", "location_absolute", "show_preview", "show_options", "show_texture", "warning_propagation",
    "active_material", "active_material_index", "active_shape_key", "active_shape_key_index", "pose", "children",
    "edit_mesh", "library_weak_reference", "particle_systems", "grease_pencil_modifiers", "splines", "execution_time",
    "internal_links", "dimensions", "width", "height", "label", "location_in_parent",
}  # fmt: skip
"""Values that change no picture, are large, or come from other values."""

SCENE = (
    "render.resolution_x", "render.resolution_y", "render.resolution_percentage", "render.pixel_aspect_x",
    "render.pixel_aspect_y", "render.use_border", "render.border_min_x", "render.border_min_y", "render.border_max_x",
    "render.border_max_y", "render.use_crop_to_border", "render.film_transparent", "render.filter_size",
    "render.use_motion_blur", "render.motion_blur_shutter", "render.motion_blur_position", "render.use_simplify",
    "render.simplify_subdivision_render", "render.simplify_child_particles_render", "render.use_freestyle",
    "render.use_multiview", "render.hair_type", "render.hair_subdiv", "render.engine", "frame_current",
    "frame_subframe", "unit_settings.scale_length", "use_gravity",
)  # fmt: skip

REMEMBERED_DATA = {"MESH", "CURVE", "SURFACE", "META", "FONT", "LIGHT", "CAMERA"}
"""Types of objects whose data are; points of curves are left to what the tracer sees of them."""


class Snapshot:
    """The scene as it was when this was made. `reason(scene)` says what has changed since."""

    def __init__(self, scene: bpy.types.Scene) -> None:
        self._scene = _of_scene(scene)
        known = {_key(b_id): b_id for b_id in _remembered(scene)}
        self._ids = {key: digest(b_id) for key, b_id in known.items()}
        self._touched: dict[str, None] = {}  # what has not been found to be as it was

    def touch(self, b_update: bpy.types.DepsgraphUpdate) -> None:
        """The dependency graph has been told of a change; any thread, any depsgraph."""
        b_id = b_update.id.original
        if not (b_update.is_updated_geometry or b_update.is_updated_transform or b_update.is_updated_shading):
            return
        if isinstance(b_id, (bpy.types.Scene, bpy.types.Collection, bpy.types.Action)):
            return  # what they do shows in what they hold, and in the scene's own values
        if trace_scenes.is_ours(b_id):
            return
        if isinstance(b_id, bpy.types.NodeTree) and (b_id.is_embedded_data or b_id.bl_idname == "CompositorNodeTree"):
            return  # its owner is told of, too
        self._touched[_key(b_id)] = None

    def reason(self, scene: bpy.types.Scene, thorough: bool = False) -> str:
        """What has changed, as the subject and verb of a sentence; "" if nothing has.

        thorough: look at everything that is remembered, touched or not.
        """
        if _of_scene(scene) != self._scene:
            return "the scene's settings have changed"
        known = {_key(b_id): b_id for b_id in _remembered(scene)} if thorough or self._touched else {}
        if thorough and known.keys() != self._ids.keys():
            odd = sorted(known.keys() ^ self._ids.keys())[0]
            return f"{odd.partition(' ')[2]!r} is new or gone"
        for key in list(known if thorough else self._touched):
            if key not in known:
                return f"{key.partition(' ')[2]!r} has changed"
            if digest(known[key]) != self._ids.get(key):
                return f"{known[key].name!r} has changed"
            self._touched.pop(key, None)  # as it was, or as it is again
        return next((f"{key.partition(' ')[2]!r} has changed" for key in self._touched), "")


def _key(b_id: bpy.types.ID) -> str:
    return f"{type(b_id).__name__} {b_id.name_full}"


def _remembered(scene: bpy.types.Scene) -> Iterator[bpy.types.ID]:
    """Objects and their data, the materials that they wear, and the world."""
    for b_object in scene.objects:
        yield b_object
        if b_object.type in REMEMBERED_DATA and b_object.data is not None:
            yield b_object.data
        yield from filter(None, (b_slot.material for b_slot in b_object.material_slots))
    if scene.world is not None:
        yield scene.world


def _of_scene(scene: bpy.types.Scene) -> tuple[object, ...]:
    """What of the scene itself EEVEE draws by."""
    values = [scene.path_resolve(path) for path in SCENE if _has(scene, path)]
    layers = [(layer.name, layer.get("hybrid_source"), _layers(layer.layer_collection)) for layer in scene.view_layers]
    traced = (*scene_setup.ray_traced_objects(scene), *scene_setup.ray_traced_materials(scene))
    ray_traced = sorted(f"{type(b_id).__name__} {b_id.name_full}" for b_id in traced)
    pointers = [b_id.name_full if b_id else "" for b_id in (scene.camera, scene.world)]
    own = [_own_properties(owner) for owner in (scene, *scene.view_layers)]
    return (*values, _values(scene.eevee), *layers, *ray_traced, *pointers, *own)


def _layers(b_layer: bpy.types.LayerCollection) -> list[object]:
    own = (b_layer.name, b_layer.exclude, b_layer.holdout, b_layer.indirect_only, b_layer.collection.hide_render)
    return [own, *map(_layers, b_layer.children)]


def _has(scene: bpy.types.Scene, path: str) -> bool:
    owner, _, name = path.rpartition(".")
    return hasattr(getattr(scene, owner) if owner else scene, name)


def digest(b_id: bpy.types.ID) -> bytes:
    """A hash of all that a datablock holds, but for our own values and animation."""
    result = hashlib.blake2b(repr(_values(b_id)).encode(), digest_size=16)
    result.update(repr(_own_properties(b_id)).encode())
    if isinstance(b_id, bpy.types.Object):
        result.update(np.array(b_id.matrix_world, np.float32).tobytes())
    if isinstance(b_id, bpy.types.Mesh):
        active = [(b_layer.name, b_layer.active_render) for b_layer in b_id.uv_layers]
        materials = [b_material.name_full if b_material else "" for b_material in b_id.materials]
        keys = b_id.shape_keys.name_full if b_id.shape_keys else ""
        result.update(repr((active, b_id.color_attributes.render_color_index, materials, keys)).encode())
        for name, field in (("loops", "vertex_index"), ("polygons", "loop_start"), ("polygons", "material_index")):
            result.update(_array(getattr(b_id, name), field))
        for b_attribute in b_id.attributes:
            result.update(b_attribute.name.encode() + _attribute(b_attribute))
    return result.digest()


def _own_properties(b_id: bpy.types.bpy_struct) -> list[object]:
    """Custom properties that a shader's Attribute may read."""
    return [(key, rgba_in(b_id, key)) for key in sorted(b_id.keys()) if key not in b_id.bl_rna.properties]


def _array(collection: Any, field: str, kind: Any = np.int32, width: int = 1) -> bytes:
    values = np.empty(width * len(collection), kind)
    collection.foreach_get(field, values)
    return values.tobytes()


def _attribute(b_attribute: bpy.types.Attribute) -> bytes:
    """Of the types that shape and shading depend on; others by their name alone."""
    field, width = FIELDS.get(b_attribute.data_type, ("", 0))
    kind = {"BOOLEAN": np.bool_, "INT": np.int32, "INT8": np.int8}.get(b_attribute.data_type, np.float32)
    return _array(b_attribute.data, field, kind, width) if field else b""


DEEPEST = 4
"""Below a datablock: further down are ways back up."""


def _values(b_struct: Any, depth: int = 0) -> list[object]:
    """All that is below a piece of Blender's data; other datablocks by name, node trees with what they hold."""
    found: list[object] = []
    b_type: Any = type(b_struct)
    for name, kind in _properties(b_type, len(b_struct.bl_rna.properties)):
        value: Any = getattr(b_struct, name, None)
        if kind == "COLLECTION":
            found += [name, [_value(item, depth) for item in value]]
        elif kind == "POINTER":
            found += [name, _value(value, depth)]
        else:
            found += [name, np.array(value).tolist() if kind == "ARRAY" else value]
    if isinstance(b_struct, bpy.types.NodesModifier):
        found += [str(value) for value in node_inputs(b_struct)]
    return found


@cache
def _properties(b_type: Any, _number: int) -> tuple[tuple[str, str], ...]:
    """Names and kinds of those that a type of Blender's data is remembered by. To ask Blender takes as long as to read
    them; an add-on may add some at any time: `_number`, how many there are, tells."""
    found = []
    for b_property in b_type.bl_rna.properties:
        name, kind = b_property.identifier, b_property.type
        large = issubclass(b_type, bpy.types.Mesh) and kind in {"COLLECTION", "POINTER"}
        is_deprecated = getattr(b_property, "is_deprecated", False)  # from Blender 5 on; to read it is a warning
        if name not in SKIPPED and not large and not is_deprecated:
            found.append((name, "ARRAY" if getattr(b_property, "is_array", False) else kind))
    return tuple(found)


def _value(value: Any, depth: int) -> object:
    if isinstance(value, bpy.types.NodeTree):
        return _tree(value) if depth < DEEPEST else value.name_full
    if isinstance(value, bpy.types.ID):
        return value.name_full
    if isinstance(value, (bpy.types.Node, bpy.types.NodeSocket, bpy.types.NodeLink)) or depth >= DEEPEST:
        return getattr(value, "name", "")
    return _values(value, depth + 1) if isinstance(value, bpy.types.bpy_struct) else str(value)


def _tree(tree: bpy.types.NodeTree) -> list[object]:
    """Nodes, what is set in them and in their sockets, and links."""
    found: list[object] = [tree.name]
    for node in tree.nodes:
        own = _values(node, 1)
        found.append([own, [_value(getattr(s, "default_value", None), 2) for s in (*node.inputs, *node.outputs)]])
    for link in tree.links:
        found.append((link.from_node.name, link.from_socket.identifier, link.to_node.name, link.to_socket.identifier))
    return found
