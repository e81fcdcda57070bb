# SPDX-License-Identifier: GPL-3.0-or-later
"""The translator: a Blender depsgraph -> hybrid_addon.scene.Scene, one kind of datablock a file.

    camera.py light.py world.py     those three, with their units
    objects.py                      which objects appear where, and what they wear
    mesh.py strands.py tubes.py     evaluated meshes -> arrays; hair, curves and points -> thin triangles
    material.py shaders.py volume.py    node trees and Custom settings -> Surface, Medium
    grids.py                        voxels of volume objects and smoke
    values.py value_nodes.py texture_nodes.py object_nodes.py    nodes of numbers and colours -> expressions
    object_values.py                what surfaces read of the object that wears them
    texture.py image.py sky.py      image nodes -> Texture, images (image_file.py) and skies -> texels
    displacement.py attributes.py   meshes moved by their materials; data of their corners
    lobes.py sums.py conductor.py   groups of a shader's inputs; Mix and Add Shader; metals of measured n and k
    light_strength.py linking.py    what holds for all lights; which lights light what
    cache.py likely_to_move.py      what one frame leaves for the next; what is likely to change until then
    skybake.py                      the script of the Blender that draws a sky
    nodes.py                        walking back through node links
    settings.py surface_programs.py messages.py    the artist's settings; what he is told
    coverage/                       what is followed and what is named, setting by setting

Values with the prefix b_ belong to Blender; the others are ours. Nothing in a translated scene refers to Blender.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from ...scene import Camera, Scene, SunLight
from ..flags import Flags
from ..view_layers import source_layer
from .cache import MeshCache
from .camera import Eye, Size, Window, translate_camera
from .coverage.scene import name_scene
from .displacement import Sampler
from .image import Images
from .light import Falloff, LightContext
from .light_strength import scaled
from .material import Surfaces, warn_of_roughness
from .messages import UnsupportedError, Warnings
from .objects import Objects
from .settings import arriving, direct_strength, material_override, rough_samples
from .texture import facts_of
from .volume import fog_of
from .world import translate_world

__all__ = ["MeshCache", "Translation", "UnsupportedError", "Warnings", "translate"]


@dataclass(frozen=True, eq=False)
class Translation:
    """A scene, what the artist should know about it, and how much of what it holds.

    owners : of each of the instances the name of the object whose Ray Traced flag decides: it, or its instancer.
    """

    scene: Scene
    warnings: tuple[str, ...]
    counts: dict[str, int]
    owners: tuple[str, ...]


def translate(
    b_depsgraph: bpy.types.Depsgraph,
    b_scene: bpy.types.Scene,
    resolution: Size,
    window: Window,
    *,
    light_falloff: Falloff = "EEVEE",
    camera: Camera | None = None,
    warn: Warnings | None = None,
    kept: MeshCache | None = None,
    sample: Sampler | None = None,
    shown: frozenset[str] | None = None,
    eye: Eye | None = None,
) -> Translation:
    """Everything that one frame needs, copied out of Blender.

    b_depsgraph : evaluated at the frame; of `b_scene` itself, or of a scene whose Background Scene it is.
    b_scene     : the artist's scene: camera, world and render settings are its own.
    resolution  : (width, height) of the full frame in pixels.
    window      : (x0, y0, x1, y1), half open, the part of the frame to render.
    light_falloff : "EEVEE" ends lights where EEVEE does, "PHYSICAL" never.
    camera      : seen by this one instead of the scene's; then resolution and window are its own.
    kept        : of earlier frames; meshes that are as they were are the same objects as in the last one.
    sample      : looks up the images that displace meshes, which the tracer can.
    shown       : full names of the objects, or of their instancers, that are there; None: all that are evaluated.
    eye         : where the view in work has the scene's camera.

    Raises UnsupportedError, before anything costly, if there is no camera or one that cannot be traced.
    """
    warn = Warnings() if warn is None else warn
    camera = camera or translate_camera(b_depsgraph, b_scene, resolution, window, warn, eye)
    kept = MeshCache() if kept is None else kept
    kept.begin()
    images = Images(warn, kept)
    name_scene(b_scene, warn)
    frame = facts_of(b_scene, camera.matrix_world, camera.projection == "ORTHO", b_depsgraph)
    world, medium = translate_world(b_depsgraph, b_scene, images, warn, frame)
    surfaces = Surfaces(images, warn, frame, material_override(b_scene, b_depsgraph))
    light_context = LightContext(light_falloff, b_scene.eevee.light_threshold)
    objects = Objects(surfaces, light_context, Flags(b_scene), warn, kept, sample)
    objects.add_all(b_depsgraph, b_scene.render.hair_subdiv, source_layer(b_scene).use_strand, shown)
    kept.end()
    if not rough_samples(b_scene):
        warn_of_roughness(surfaces.surfaces, warn)
    scene = Scene(
        camera=camera,
        meshes=tuple(objects.meshes),
        instances=tuple(objects.instances),
        surfaces=tuple(surfaces.surfaces),
        lights=tuple(
            scaled(light, direct_strength(b_scene), b_scene.eevee.use_shadows)
            for light in objects.lights
            if not (medium.dims and isinstance(light, SunLight))
        ),
        world=world,
        arriving=arriving(b_scene),
        fog=fog_of(b_scene, medium, objects.fog),
    )
    return Translation(scene, tuple(warn), _counts(scene), tuple(objects.owners))


def _counts(scene: Scene) -> dict[str, int]:
    """Of each kind; `triangles` counts a mesh once for each of its instances."""
    return {
        "instances": len(scene.instances),
        "ray_traced": sum(scene.is_ray_traced(instance) for instance in scene.instances),
        "meshes": len(scene.meshes),
        "triangles": sum(len(scene.meshes[instance.mesh].triangles) for instance in scene.instances),
        "surfaces": len(scene.surfaces),
        "lights": len(scene.lights),
    }
