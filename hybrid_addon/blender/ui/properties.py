"""What the artist can set, per object and per scene. docs/manual/settings.md is made from the descriptions."""

# No `from __future__ import annotations` here: Blender reads the properties from the annotations themselves.

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty
from bpy.types import Collection, Context, Material, Object, PropertyGroup, Scene

from .. import preview
from ..pipeline import scene_setup
from ..render import caches, retrace
from . import defaults, insets


def _flag_changed(settings: "HybridObjectSettings", _context: Context) -> None:
    scene_setup.object_changed(settings.id_data)


def _collection_changed(_settings: "HybridCollectionSettings", _context: Context) -> None:
    scene_setup.collection_changed()


def _value_changed(settings: "HybridObjectSettings | HybridMaterialSettings", _context: Context) -> None:
    settings.surface = "CUSTOM"  # whoever moves a slider, or sets a value from Python, means it


def _enabled_changed(settings: "HybridSceneSettings", context: Context) -> None:
    defaults.stamp(settings.id_data)
    _scene_changed(settings, context)
    if not settings.enabled and not bpy.app.background:  # there `render` switches it on and off again for each frame
        caches.forget()
        preview.forget()
        retrace.forget()


def _scene_changed(settings: "HybridSceneSettings", _context: Context) -> None:
    scene_setup.scene_changed(settings.id_data)


def _passes_changed(settings: "HybridSceneSettings", _context: Context) -> None:
    scene_setup.passes_changed(settings.id_data)


def _preview_changed(_settings: "HybridSceneSettings", _context: Context) -> None:
    preview.setting_changed()


def _insets_changed(_settings: "HybridSceneSettings", _context: Context) -> None:
    insets.redraw()


class SurfaceValues:
    """The three numbers that an object or a material may have of its own. Blender finds them in base classes, too."""

    reflectivity: FloatProperty(  # type: ignore[valid-type]
        name="Reflectivity",
        description="Share of the light that is mirrored: 0 none, 1 a perfect mirror",
        default=0.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        update=_value_changed,
    )
    opacity: FloatProperty(  # type: ignore[valid-type]
        name="Opacity",
        description="1 is solid; below 1 the rest of the light passes through, bent by the IOR",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        update=_value_changed,
    )
    ior: FloatProperty(  # type: ignore[valid-type]
        name="IOR",
        description="Index of refraction: water 1.33, glass 1.5, diamond 2.42. Type a value below 1 for a bubble",
        default=1.5,
        min=1e-6,
        max=1e6,
        soft_min=1.0,
        soft_max=3.0,
        precision=3,
        update=_value_changed,
    )


class HybridObjectSettings(SurfaceValues, PropertyGroup):
    """`Object.hybrid`: whether the object is ray traced, and how its surface answers light."""

    ray_traced: BoolProperty(  # type: ignore[valid-type]
        name="Ray Traced",
        description="Draw this object with the ray tracer; EEVEE draws everything else",
        default=False,
        options=set(),  # not animatable: a view layer's holdout cannot change between frames
        override={"LIBRARY_OVERRIDABLE"},
        update=_flag_changed,
    )
    surface: EnumProperty(  # type: ignore[valid-type]
        name="Surface",
        description="Where reflectivity, opacity and IOR come from",
        items=(
            ("MATERIAL", "From Material", "Read them from the object's materials (metallic, transmission, alpha, IOR)"),
            ("CUSTOM", "Custom", "Use the values below instead of the materials'"),
        ),
        default="MATERIAL",
    )

    @classmethod
    def register(cls) -> None:
        """Attach to bpy.types.Object."""
        Object.hybrid = PointerProperty(name="Hybrid", description="Hybrid ray tracing", type=cls)

    @classmethod
    def unregister(cls) -> None:
        """Detach again."""
        del Object.hybrid


class HybridMaterialSettings(SurfaceValues, PropertyGroup):
    """`Material.hybrid`: how this material answers light where it is ray traced, slot by slot."""

    surface: EnumProperty(  # type: ignore[valid-type]
        name="Surface",
        description="Where reflectivity, opacity and IOR of this material come from",
        items=(
            ("MATERIAL", "From Nodes", "Read them from the shader nodes (metallic, transmission, alpha, IOR)"),
            ("CUSTOM", "Custom", "Use the values below instead of the nodes'; an object's own Custom wins over them"),
        ),
        default="MATERIAL",
    )

    @classmethod
    def register(cls) -> None:
        """Attach to bpy.types.Material."""
        Material.hybrid = PointerProperty(name="Hybrid", description="Hybrid ray tracing", type=cls)

    @classmethod
    def unregister(cls) -> None:
        """Detach again."""
        del Material.hybrid


class HybridCollectionSettings(PropertyGroup):
    """`Collection.hybrid`: whether all its objects are ray traced."""

    ray_traced: BoolProperty(  # type: ignore[valid-type]
        name="Ray Traced",
        description="Draw all objects in this collection, in those below it, and its instances with the ray tracer",
        default=False,
        options=set(),  # as for objects
        override={"LIBRARY_OVERRIDABLE"},
        update=_collection_changed,
    )

    @classmethod
    def register(cls) -> None:
        """Attach to bpy.types.Collection."""
        Collection.hybrid = PointerProperty(name="Hybrid", description="Hybrid ray tracing", type=cls)

    @classmethod
    def unregister(cls) -> None:
        """Detach again."""
        del Collection.hybrid


class HybridSceneSettings(PropertyGroup):
    """`Scene.hybrid`: the switch, the quality, and (hidden) what the pipeline made in this scene."""

    enabled: BoolProperty(  # type: ignore[valid-type]
        name="Hybrid",
        description="Draw the ray traced objects of this scene with the ray tracer, composited into EEVEE's picture",
        default=False,
        update=_enabled_changed,
    )
    mode: EnumProperty(  # type: ignore[valid-type]
        name="Mode",
        description="Which renderer draws what",
        items=(
            ("HYBRID", "Hybrid", "EEVEE draws the scene, the ray tracer draws the ray traced objects"),
            ("RASTER", "Raster", "EEVEE draws everything, as if the add-on were off"),
            ("FULL", "Full", "The ray tracer draws every pixel; EEVEE is not used"),
        ),
        default="HYBRID",
        update=_scene_changed,
    )
    samples: IntProperty(  # type: ignore[valid-type]
        name="Samples",
        description="Rays through each ray traced pixel (supersampling). 1 switches it off",
        default=16,
        min=1,
        max=65536,
        soft_max=256,
    )
    max_depth: IntProperty(  # type: ignore[valid-type]
        name="Max Bounces",
        description="How often a ray may be reflected or refracted after it left the camera",
        default=32,
        min=0,
        max=1024,
        soft_max=64,
    )
    cutoff: FloatProperty(  # type: ignore[valid-type]
        name="Cutoff",
        description="Share of its light that a sample may lose to rays that would bring little; 0 follows every ray",
        default=1 / 255,
        min=0.0,
        max=1.0,
        soft_max=0.1,
        precision=4,
    )
    adaptive: FloatProperty(  # type: ignore[valid-type]
        name="Adaptive Sampling",
        description="Pixels stop early where objects, paths and, within this contrast, colours agree; 0 is off",
        default=0.05,
        min=0.0,
        max=0.99,
        soft_max=0.2,
        precision=3,
    )
    time_budget: FloatProperty(  # type: ignore[valid-type]
        name="Time Budget",
        description="Seconds for a frame, EEVEE included; what does not fit is given up, samples first. 0 is no limit",
        default=0.0,
        min=0.0,
        soft_max=3600.0,
        step=100,
        unit="TIME_ABSOLUTE",
    )
    shadow_samples: IntProperty(  # type: ignore[valid-type]
        name="Shadow Samples",
        description="Rays to each light with a size, for each sample of a pixel; 0 draws hard shadows",
        default=1,
        min=0,
        max=1024,
        soft_max=16,
    )
    rough_samples: IntProperty(  # type: ignore[valid-type]
        name="Rough Samples",
        description="Rays for each reflection and refraction of what is rough; 0 shows a blurred world, no objects",
        default=1,
        min=0,
        max=64,
        soft_max=16,
    )
    occlusion_samples: IntProperty(  # type: ignore[valid-type]
        name="Occlusion Samples",
        description="Rays that find how much of the world's diffuse light is hidden in corners; 0 hides none, as EEVEE",
        default=0,
        min=0,
        max=64,
        soft_max=16,
    )
    occlusion_distance: FloatProperty(  # type: ignore[valid-type]
        name="Occlusion Distance",
        description="What is further away hides nothing; 0 takes the distance of EEVEE's Fast GI, if it has one",
        default=0.0,
        min=0.0,
        soft_max=100.0,
        unit="LENGTH",
    )
    traced_shadows: EnumProperty(  # type: ignore[valid-type]
        name="Traced Shadows",
        description="Trace the shadows of ray traced objects on what EEVEE draws: glass lets light through",
        items=(
            ("AUTO", "Automatic", "On where a ray traced object lets light through, and with Caustics", 2),
            ("OFF", "Off", "EEVEE draws them: dark, whatever the object is made of", 0),
            ("ON", "On", "The ray tracer draws them all", 1),  # 0 and 1: a tick, in older files
        ),
        default="AUTO",
        update=_scene_changed,
    )
    caustics: EnumProperty(  # type: ignore[valid-type]
        name="Caustics",
        description="Light that ray traced objects focus, where their shadows are traced",
        items=(
            ("NONE", "None", "Light goes straight through: even shadows"),
            ("SIMPLE", "Simple", "Brighten the middle of shadows by angle and IOR: a guess for round bodies, no rays"),
            ("PHOTONS", "Photons", "Trace photons from the lights through the objects, as light really goes"),
        ),
        default="NONE",
        update=_scene_changed,
    )
    photons: IntProperty(  # type: ignore[valid-type]
        name="Photons",
        description="Photons for the caustics of a frame: more make them less grainy",
        default=1_000_000,
        min=1,
        max=2_000_000_000,
        soft_max=100_000_000,
    )
    raster_backed: BoolProperty(  # type: ignore[valid-type]
        name="Raster-Backed Hits",
        description="Reflections and refractions show EEVEE's own pixels of matte surfaces, and of nodes not followed",
        default=True,
        update=_scene_changed,
    )
    light_falloff: EnumProperty(  # type: ignore[valid-type]
        name="Light Falloff",
        description="How far lights reach in the ray traced objects and in what they reflect",
        items=(
            ("EEVEE", "As EEVEE", "Fade lights out at the distance where EEVEE does, so that both halves agree"),
            ("PHYSICAL", "Physical", "Inverse square without an end, as Cycles has it"),
        ),
        default="EEVEE",
    )
    passes: EnumProperty(  # type: ignore[valid-type]
        name="Data Passes",
        description="Passes of the ray traced objects for the compositor",
        items=(
            ("DEPTH", "Depth", "Distance along the view axis; 1e10 where no ray traced object is", 1),
            ("NORMAL", "Normal", "Normal in world space, at pixel centers as depth is", 2),
            ("SAMPLES", "Samples", "Camera rays that the pixel took", 4),
            ("SHADOW", "Shadow", "Traced shadows: what is left of the light on what EEVEE draws; 1 without them", 8),
            ("REFLECTION", "Reflection", "Light that the first surface mirrors", 16),
            ("REFRACTION", "Refraction", "Light that comes through the first surface", 32),
            ("RASTER_BACKED", "Raster-Backed", "Share of the way of the light that ends at EEVEE's own pixels", 64),
            ("RESIDUAL", "Residual", "Light that was cut off, as a share; the node has it in any case", 128),
        ),
        options={"ANIMATABLE", "ENUM_FLAG"},
        default=set(),
        update=_passes_changed,
    )
    threads: IntProperty(  # type: ignore[valid-type]
        name="Threads",
        description="Processor threads for the ray tracer; 0 uses all",
        default=0,
        min=0,
        max=1024,
    )
    preview: BoolProperty(  # type: ignore[valid-type]
        name="Ray Traced Preview",
        description="Trace the ray traced objects in rendered viewports as soon as the view rests",
        default=False,
        options=set(),
        update=_preview_changed,
    )
    preview_budget: FloatProperty(  # type: ignore[valid-type]
        name="Preview Time",
        description="Seconds that a viewport at rest may be refined for; 0 goes on until it has all Samples",
        default=0.0,
        min=0.0,
        max=3600.0,
        soft_max=60.0,
        subtype="TIME_ABSOLUTE",
        options=set(),
        update=_preview_changed,
    )
    insets: BoolProperty(  # type: ignore[valid-type]
        name="Insets",
        description="Mask and traced half as two small pictures over the Render Result",
        default=False,
        options=set(),
        update=_insets_changed,
    )
    shown: EnumProperty(  # type: ignore[valid-type]
        name="Show",
        description="What the Image Editor shows of the last render, in full size",
        items=(
            ("PICTURE", "Picture", "The Render Result: both halves, and your compositor nodes"),
            ("RASTER", "EEVEE's Half", "What EEVEE drew, times 1 - mask"),
            ("TRACED", "Traced Half", "What the ray tracer drew, times the mask"),
            ("MASK", "Mask", "Share of each pixel that ray traced objects cover"),
        ),
        default="PICTURE",
        options=set(),
        update=_insets_changed,
    )
    # Of the defaults that these settings were made with (defaults.py).
    version: IntProperty(options={"HIDDEN"})  # type: ignore[valid-type]
    # What the pipeline has to put back (JSON).
    restore: StringProperty(options={"HIDDEN"})  # type: ignore[valid-type]
    # What the user has linked to our nodes, while these are away (JSON).
    memory: StringProperty(options={"HIDDEN"})  # type: ignore[valid-type]

    @classmethod
    def register(cls) -> None:
        """Attach to bpy.types.Scene."""
        Scene.hybrid = PointerProperty(name="Hybrid", description="Hybrid ray tracing", type=cls)

    @classmethod
    def unregister(cls) -> None:
        """Detach again."""
        del Scene.hybrid


CLASSES = (HybridObjectSettings, HybridMaterialSettings, HybridCollectionSettings, HybridSceneSettings)
