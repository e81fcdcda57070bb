# SPDX-License-Identifier: GPL-3.0-or-later
"""What the scene builders share: a new scene, flags, camera, lights, animation, packed images, materials, counts."""

from __future__ import annotations

import math
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np
import shapes
from mathutils import Vector

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

try:
    import hybrid_addon
except ImportError:  # the scenes can be built without the add-on; then nothing is ray traced
    hybrid_addon = None

FRAMES = 24


# ------------------------------------------------------------------------------------------------ scene


def new_scene(name):
    """An empty file with one scene: 1024x768, 24 frames at 24 fps, EEVEE with 16 samples."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if hasattr(hybrid_addon, "register") and not hasattr(bpy.types.Object, "hybrid"):
        hybrid_addon.register()
    scene = bpy.context.scene
    scene.name = name
    engines = {item.identifier for item in bpy.types.RenderSettings.bl_rna.properties["engine"].enum_items}
    scene.render.engine = "BLENDER_EEVEE_NEXT" if "BLENDER_EEVEE_NEXT" in engines else "BLENDER_EEVEE"
    scene.eevee.taa_render_samples = 16
    scene.render.resolution_x, scene.render.resolution_y = 1024, 768
    scene.render.resolution_percentage = 100
    scene.render.fps = FRAMES
    scene.frame_start, scene.frame_end = 1, FRAMES
    scene.view_settings.view_transform = "AgX"
    scene.view_settings.look = "AgX - Medium High Contrast"
    scene.cycles.samples = 64
    bpy.context.preferences.filepaths.save_version = 0
    return scene


def finish():
    """Take the add-on out of Blender again: the bpy 4.5 wheel does not survive its exit with handlers left in it."""
    if hasattr(hybrid_addon, "unregister") and hasattr(bpy.types.Object, "hybrid"):
        hybrid_addon.unregister()


def flag(obj, **values):
    """Have `obj` ray traced: From Material, or Custom where a reflectivity, opacity or IOR is given."""
    if hasattr(hybrid_addon, "mark"):
        hybrid_addon.mark(obj, **values)
    return obj


def camera(location, target, lens, name="Camera", near=0.05):
    """The scene's camera, aimed at `target`."""
    data = bpy.data.cameras.new(name)
    data.lens, data.clip_start, data.clip_end = lens, near, 200.0
    obj = shapes.link(bpy.data.objects.new(name, data))
    bpy.context.scene.camera = aim(obj, location, target)
    return obj


def aim(obj, location, target):
    """Put `obj` there, its -Z, where cameras and lamps look, towards `target`."""
    obj.location = location
    obj.rotation_euler = (Vector(target) - Vector(location)).to_track_quat("-Z", "Y").to_euler()
    return obj


def lamp(name, location, watts, colour=(1.0, 1.0, 1.0), radius=0.02):
    """A point light. EEVEE's window ends it at sqrt(watts) metres (default threshold 0.01)."""
    data = bpy.data.lights.new(name, "POINT")
    data.energy, data.color, data.shadow_soft_size = watts, colour, radius
    obj = shapes.link(bpy.data.objects.new(name, data))
    obj.location = location
    return obj


def softbox(name, location, target, watts, size, colour=(1.0, 1.0, 1.0), round_=False):
    """An area light; `size` is one number or (across, up); `round_`: a disk instead of a square, an ellipse."""
    square = isinstance(size, (int, float))
    data = bpy.data.lights.new(name, "AREA")
    data.energy, data.color = watts, colour
    data.shape = ("DISK" if round_ else "SQUARE") if square else ("ELLIPSE" if round_ else "RECTANGLE")
    data.size, data.size_y = (size, size) if square else size
    return aim(shapes.link(bpy.data.objects.new(name, data)), location, target)


def sun(name, location, target, strength, colour=(1.0, 1.0, 1.0)):
    """A sun that shines from `location` towards `target`, half a degree wide."""
    data = bpy.data.lights.new(name, "SUN")
    data.energy, data.color = strength, colour
    return aim(shapes.link(bpy.data.objects.new(name, data)), location, target)


def grey_world(colour):
    """A world of one colour."""
    data = bpy.data.worlds.new("World")
    if not data.node_tree:
        data.use_nodes = True
    next(n for n in data.node_tree.nodes if n.type == "BACKGROUND").inputs["Color"].default_value = (*colour, 1.0)
    bpy.context.scene.world = data
    return data


def world(picture, strength):
    """A world of one equirectangular picture."""
    data = bpy.data.worlds.new(picture.name)
    if not data.node_tree:
        data.use_nodes = True
    nodes, links = data.node_tree.nodes, data.node_tree.links
    nodes.clear()
    environment = nodes.new("ShaderNodeTexEnvironment")
    environment.image = picture
    background = nodes.new("ShaderNodeBackground")
    background.inputs["Strength"].default_value = strength
    output = nodes.new("ShaderNodeOutputWorld")
    environment.location, background.location, output.location = (-300, 0), (0, 0), (200, 0)
    links.new(environment.outputs["Color"], background.inputs["Color"])
    links.new(background.outputs["Background"], output.inputs["Surface"])
    bpy.context.scene.world = data
    return data


def animate(obj, path, keys, linear=False):
    """Keyframes of `obj.path`: {frame: value}."""
    for frame, value in keys.items():
        setattr(obj, path, value)
        obj.keyframe_insert(path, frame=frame)
    setattr(obj, path, keys[min(keys)])
    action = obj.animation_data.action
    for curve in action.layers[0].strips[0].channelbags[0].fcurves:
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR" if linear else "BEZIER"


def spin(obj, turns=1.0):
    """Turn `obj` about its Z axis, evenly, so that frame 25 would be frame 1 again."""
    start = obj.rotation_euler.copy()
    end = (start.x, start.y, start.z + turns * 2 * math.pi)
    animate(obj, "rotation_euler", {1: tuple(start), FRAMES + 1: end}, linear=True)


# ------------------------------------------------------------------------------------------------ images, materials


def packed(name, pixels, quality=90):
    """An image made of `pixels` (height, width, 3 sRGB values) and packed into the file as JPEG."""
    height, width = pixels.shape[:2]
    image = bpy.data.images.new(name, width, height)
    rgba = np.concatenate([pixels, np.ones((height, width, 1))], axis=-1)
    image.pixels.foreach_set(rgba.astype(np.float32).ravel())
    with tempfile.TemporaryDirectory() as folder:
        image.file_format = "JPEG"
        image.filepath_raw = str(Path(folder) / f"{name}.jpg")
        image.save(quality=quality)
        image.pack()
    image.filepath_raw = image.packed_files[0].filepath = f"//{name}.jpg"
    return image


SOCKETS = {
    "colour": "Base Color",
    "metallic": "Metallic",
    "roughness": "Roughness",
    "ior": "IOR",
    "transmission": "Transmission Weight",
    "coat": "Coat Weight",
    "coat_roughness": "Coat Roughness",
    "subsurface": "Subsurface Weight",
    "subsurface_scale": "Subsurface Scale",
    "emission": "Emission Color",
    "strength": "Emission Strength",
}


def material(name, image=None, **values):
    """A Principled material; `colour` is linear RGB, `image` takes its place."""
    mat = bpy.data.materials.new(name)
    if not mat.node_tree:
        mat.use_nodes = True
    principled = next(n for n in mat.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    for key, value in values.items():
        principled.inputs[SOCKETS[key]].default_value = (*value, 1.0) if isinstance(value, tuple) else value
    if image:
        texture = mat.node_tree.nodes.new("ShaderNodeTexImage")
        texture.image, texture.location = image, (-320, 300)
        mat.node_tree.links.new(texture.outputs["Color"], principled.inputs["Base Color"])
    if "colour" in values:
        mat.diffuse_color = (*values["colour"], 1.0)
    return mat


def glass(name="Glass", ior=1.5, colour=(1.0, 1.0, 1.0), roughness=0.0):
    """Clear glass, frosted with a roughness, for EEVEE, Cycles and the tracer alike."""
    return material(name, colour=colour, roughness=roughness, ior=ior, transmission=1.0)


def node(mat, kind, inputs=(), **values):
    """A node more in `mat`: `inputs` are {socket: value or output of another node}, `values` its properties."""
    new = mat.node_tree.nodes.new(kind)
    for key, value in values.items():
        setattr(new, key, value)
    plug(mat, new, dict(inputs))
    return new


def plug(mat, node, inputs):
    """Set or link sockets of a node; "Principled" is the material's shader."""
    if node == "Principled":
        node = next(n for n in mat.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    for key, value in inputs.items():
        if isinstance(value, bpy.types.NodeSocket):
            mat.node_tree.links.new(value, node.inputs[key])
        else:
            node.inputs[key].default_value = value


# ------------------------------------------------------------------------------------------------ counting, saving


def triangles():
    """Triangles of everything that is rendered, modifiers applied: {name: count}."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    counts = {}
    for instance in depsgraph.object_instances:
        if instance.object.type == "MESH":
            data = instance.object.data
            data.calc_loop_triangles()
            counts[instance.object.name] = counts.get(instance.object.name, 0) + len(data.loop_triangles)
    return counts


def fill(target, low, high):
    """How many triangles the last object must have for a total of `target`; it should lie in low..high."""
    rest = target - sum(triangles().values())
    if not low <= rest <= high:
        raise ValueError(f"the filler would have {rest} triangles; the model should leave it {low} to {high}")
    return rest


def save(path):
    """Write the file with Hybrid switched on, compressed, with nothing in it that is not used."""
    bpy.context.scene.frame_set(1)
    bpy.context.scene.hybrid.enabled = True  # the pipeline itself is never saved
    bpy.data.orphans_purge(do_recursive=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True, relative_remap=False)
