# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's materials, and the artist's Custom settings of an object, -> scene.Surface.

The rule for Custom: a material's own numbers replace reflectivity, opacity and IOR of its nodes; an object's own
replace those of *all* its materials. Base colour, image, emission and roughness stay. The tints stay, too, and a
material has one only for what it does itself: mirrored light is tinted by the base colour of a *metallic* material, and
passing light by that of a *transmissive* one, else by nothing. So a grey object set to a perfect mirror mirrors without
loss, set to opacity 0 it is clear glass, and gold stays gold.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import bpy

from ...scene import WHITE, Expression, Medium, Surface
from ..flags import is_ticked, is_traced_by_itself, why_not
from .coverage import name_settings, name_sockets
from .displacement import bent, displacement_of
from .image import Images
from .messages import Warnings
from .nodes import Node, active_output, uses_nodes
from .settings import NOTHING_OF_ITS_OWN, CustomSurface, custom_surface
from .shaders import surface_from
from .sums import averaged, each, singles
from .surface_programs import programmed
from .texture import FrameFacts, NodeReader
from .volume import absorption_from, default_medium, medium_from, scaled

MIRROR_ROUGHNESS = 0.25  # above it a sharp mirror image looks wrong enough to be worth a warning
DEFAULT = Surface(specular=(0.04, 0.04, 0.04), ior=1.5, layered=True, edge_tint=WHITE)
"""Of an object without material: a new Principled BSDF (BKE_material_default_surface)."""


class Surfaces:
    """The scene's surfaces, each pair of material and Custom settings once.

    moves      : of each the vector in world space by which it moves its vertices (`displacement`); None: it does not.
    b_override : the view layer's Material Override, which all objects wear instead, or None.
    """

    def __init__(
        self,
        images: Images,
        warn: Warnings,
        frame: FrameFacts,
        b_override: bpy.types.Material | None = None,
    ) -> None:
        self._images = images
        self.frame = frame
        self._b_override = b_override
        self._warn = warn
        self._materials: dict[str, tuple[Surface, Any]] = {}
        self._media: dict[tuple[str, Any], Medium | None] = {}
        self._index: dict[tuple[str, CustomSurface], int] = {}
        self.surfaces: list[Surface] = []
        self.moves: list[Any] = []

    def index_of(self, b_material: bpy.types.Material | None, custom: CustomSurface) -> int:
        """Position in `surfaces`."""
        if self._b_override is not None:
            b_material, custom = self._b_override, NOTHING_OF_ITS_OWN
        key = (b_material.name_full if b_material else "", custom)
        if key not in self._index:
            self._index[key] = len(self.surfaces)
            surface, moved = self._of_material(b_material)
            self.moves.append(moved if b_material is not None and b_material.displacement_method != "BUMP" else None)
            whole = custom.over(custom_surface(b_material))
            surface = customised(surface, replace(whole, program=None))
            self.surfaces.append(programmed(surface, whole.program, self._warn))
        return self._index[key]

    def _of_material(self, b_material: bpy.types.Material | None) -> tuple[Surface, Any]:
        if b_material is None:
            return DEFAULT, None
        if b_material.name_full not in self._materials:
            self._materials[b_material.name_full] = surface_and_displacement(
                b_material, self._images, self._warn, self.frame
            )
        return self._materials[b_material.name_full]

    def medium_of(self, b_object: bpy.types.Object, grids: Mapping[str, int], scale: float) -> Medium | None:
        """What fills an object that has grids, by the first of its materials that has a volume; None: nothing does.

        grids : see `medium_from`.   scale : what all of it is multiplied by.
        """
        for b_material in [b_slot.material for b_slot in b_object.material_slots] or [None]:
            b_worn = self._b_override or b_material
            key = (b_worn.name_full if b_worn else "", tuple(sorted(grids.items())))
            if key not in self._media:
                self._media[key] = self._medium(b_worn, grids)
            medium = self._media[key]
            if medium is not None:
                return None if medium.is_nothing else scaled(medium, scale)
        return None

    def _medium(self, b_material: bpy.types.Material | None, grids: Mapping[str, int]) -> Medium | None:
        if b_material is None:
            return default_medium(grids)
        output = active_output(b_material.node_tree) if uses_nodes(b_material) else None
        if output is None or output.input("Volume").node() is None:
            return None
        name_settings(b_material, f"material {b_material.name!r}", self._warn)
        return medium_from(output.input("Volume"), _reader(b_material, self._images, self._warn, self.frame), grids)


def customised(surface: Surface, custom: CustomSurface) -> Surface:
    """`surface` with the object's own numbers, where it has them."""
    if custom == NOTHING_OF_ITS_OWN:
        return surface
    if custom.values is None:
        return each(surface, lambda closure: replace(closure, dispersion=custom.dispersion))
    reflectivity, opacity, ior = custom.values
    plain = replace(averaged(surface), layered=False, thin=False, interface_tint=WHITE, dispersion=custom.dispersion)
    return replace(plain, reflectivity=reflectivity, opacity=opacity, ior=ior)


def warn_of_roughness(surfaces: Sequence[Surface], warn: Warnings) -> None:
    """Name the rough surfaces that are to show the world's blurred image, and no objects."""
    for name, surface in ((whole.name, closure) for whole in surfaces for closure in singles(whole)):
        roughness = surface.roughness
        mirrors = surface.layered and surface.reflectivity != 0.0
        refracts = surface.layered and surface.opacity != 1.0 and surface.ior != 1.0
        if (mirrors or refracts) and not isinstance(roughness, Expression) and roughness > MIRROR_ROUGHNESS:
            warn.add(
                f"it shows the world blurred, but no objects: its roughness of {roughness:.2g} is not traced (set "
                "Rough Samples to 1 or more)",
                owner=f"material {name!r}",
            )


def translate_material(b_material: bpy.types.Material, images: Images, warn: Warnings, frame: FrameFacts) -> Surface:
    """The surface that a material describes, with its Backface Culling: that of the camera and that of shadows."""
    return surface_and_displacement(b_material, images, warn, frame)[0]


def surface_and_displacement(
    b_material: bpy.types.Material, images: Images, warn: Warnings, frame: FrameFacts
) -> tuple[Surface, Any]:
    """`translate_material`, and the vector in world space of its Displacement; None: there is none."""
    name_settings(b_material, f"material {b_material.name!r}", warn)
    if is_ticked(b_material) and why_not(b_material):
        warn.add(f"material {b_material.name!r}: {why_not(b_material)}")
    surface, moved = _described(b_material, images, warn, frame)
    surface = each(replace(surface, name=b_material.name), lambda closure: bent(closure, moved))
    surface = replace(
        surface,
        culled=b_material.use_backface_culling,
        shadow_culled=b_material.use_backface_culling_shadow,
        ray_traced=is_traced_by_itself(b_material),
    )
    return surface, moved


def _described(
    b_material: bpy.types.Material, images: Images, warn: Warnings, frame: FrameFacts
) -> tuple[Surface, Any]:
    """What its node tree describes, or its viewport values where it has no nodes; and what displaces it."""
    if not uses_nodes(b_material):
        return _without_nodes(b_material), None
    reader = _reader(b_material, images, warn, frame)
    output = active_output(b_material.node_tree)
    if output is None:
        reader.warn("it has no active output; it is black")
        return Surface(base_color=(0.0, 0.0, 0.0)), None
    name_sockets(output, reader)
    surface = replace(_inside_and_out(output, reader), approximate=reader.approximate)
    return surface, displacement_of(output, reader)


def _reader(b_material: bpy.types.Material, images: Images, warn: Warnings, frame: FrameFacts) -> NodeReader:
    reader = NodeReader(f"material {b_material.name!r}", images, warn, frame)
    reader.material_index = b_material.pass_index
    return reader


def _inside_and_out(output: Node, reader: NodeReader) -> Surface:
    """The surface and what lies behind it. A volume alone has a surface that does nothing."""
    if output.input("Surface").node() is None and output.input("Volume").node() is not None:
        return Surface(opacity=0.0, ior=1.0, fog=medium_from(output.input("Volume"), reader))
    surface = surface_from(output.input("Surface"), reader)
    return replace(surface, absorption=absorption_from(output.input("Volume"), reader))


def _without_nodes(b_material: bpy.types.Material) -> Surface:
    """A material with Use Nodes off is drawn by EEVEE as a Principled BSDF with the viewport values."""
    red, green, blue, _ = b_material.diffuse_color
    f0 = 0.08 * b_material.specular_intensity
    return Surface(
        base_color=(red, green, blue),
        specular=(f0, f0, f0),
        roughness=b_material.roughness,
        reflectivity=b_material.metallic,
        reflection_tint=(red, green, blue) if b_material.metallic > 0.0 else (1.0, 1.0, 1.0),
    )
