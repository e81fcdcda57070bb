# SPDX-License-Identifier: GPL-3.0-or-later
"""A walk through every setting of scenes, view layers, worlds, cameras, objects, materials and lights.

What the tables of sync/coverage call followed must change the translated scene, or the tracer's settings; what they
call named must bring its warning; the rest has its reason there. A setting that is in no table fails.
"""

from __future__ import annotations

import bpy
import pytest

from hybrid_addon.blender.render.motion_blur import moments
from hybrid_addon.blender.render.settings import tracer_settings
from hybrid_addon.blender.sync import translate
from hybrid_addon.blender.sync.coverage import OBJECT_TYPES, PROPERTIES, Followed, Irrelevant, Named, Within, status_of
from tests.blender.sync.coverage_kit import contents, items_of, other_value
from tools.followed import PAGE, page

pytestmark = pytest.mark.blender
SIZE, WINDOW = (32, 24), (0, 0, 32, 24)
OURS = {"rna_type", "hybrid"}
BASES = {"PointLight": "Light", "SpotLight": "Light", "SunLight": "Light", "AreaLight": "Light"}

ELSEWHERE = {  # followed, and proved by tests of more than one value
    # test_render, test_pipeline: what Blender asks the engine for
    "RenderSettings": "resolution_x resolution_y resolution_percentage"
    " use_border border_min_x border_min_y border_max_x border_max_y hair_subdiv",  # test_strands
    "ViewLayer": "use use_strand",  # test_pipeline, test_strands
    "World": "node_tree use_nodes",  # test_world, test_coverage_sockets
    "Material": "node_tree use_nodes displacement_method pass_index",  # test_displacement, test_object_nodes
    # test_objects, test_parity, test_object_nodes
    "Object": "type data material_slots light_linking instance_collection color pass_index",
    "Light": "type temperature_color",
    "CameraDOFSettings": "focus_subtarget",  # test_camera
    "Camera": "type",
    "SceneEEVEE": "motion_blur_steps",  # test_motion_blur
}
SINCE = {("ViewLayer", "material_override"): (5, 0, 0), ("ViewLayer", "world_override"): (5, 0, 0)}
"""What EEVEE of earlier versions does not follow either."""

WITHOUT_NODES = {  # what counts where there are no nodes, which from Blender 5 on there are always
    ("World", "color"),
    *(("Material", name) for name in ("diffuse_color", "roughness", "metallic", "specular_intensity")),
}
BESIDE = {  # what counts only beside other values: (whose, name) -> these values
    ("SceneEEVEE", "use_raytracing"): {"ray_tracing_options.trace_max_roughness": 1.0},
    ("SceneEEVEE", "bokeh_max_size"): {"scene.camera.data.dof.use_dof": True},
    ("RenderSettings", "motion_blur_shutter"): {"use_motion_blur": True},
    ("RenderSettings", "motion_blur_position"): {"use_motion_blur": True},
    ("ViewLayer", "use_motion_blur"): {"scene.render.use_motion_blur": True},
    ("Light", "temperature"): {"use_temperature": True},
    ("Light", "cutoff_distance"): {"use_custom_distance": True},
    ("Camera", "sensor_height"): {"sensor_fit": "VERTICAL"},
    ("Camera", "ortho_scale"): {"type": "ORTHO"},
    ("Material", "use_transparency_overlap"): {"surface_render_method": "BLENDED"},
    ("AreaLight", "size_y"): {"shape": "RECTANGLE"},
    ("PointLight", "use_soft_falloff"): {"shadow_soft_size": 0.2},
    ("SpotLight", "use_soft_falloff"): {"shadow_soft_size": 0.2},
}
OF_LIGHTS = ("visible_diffuse", "visible_glossy", "visible_transmission", "visible_volume_scatter")
"""Of objects: EEVEE reads them of lights alone."""

BY_HAND = {  # values that nothing like them leads to
    ("RenderSettings", "use_sequencer"): lambda b: b.id_data.sequence_editor_create() and strip(b.id_data),
    ("SceneEEVEE", "use_raytracing"): lambda b: setattr(b, "use_raytracing", True),
    ("RenderSettings", "hair_type"): lambda b: b.id_data.collection.objects.link(
        bpy.data.objects.new("Hair", bpy.data.hair_curves.new("Hair"))
    ),
    ("ViewLayer", "material_override"): lambda b: setattr(b, "material_override", bpy.data.materials.new("Clay")),
    ("ViewLayer", "world_override"): lambda b: setattr(b, "world_override", bpy.data.worlds.new("Other")),
    ("CameraDOFSettings", "focus_object"): lambda b: setattr(b, "focus_object", bpy.data.objects["Cube"]),
    ("Object", "matrix_world"): lambda b: setattr(b, "location", (1, 2, 3)),
    ("RenderSettings", "pixel_aspect_x"): lambda b: setattr(b, "pixel_aspect_x", 1.5),
    ("RenderSettings", "pixel_aspect_y"): lambda b: setattr(b, "pixel_aspect_y", 1.5),
    ("AreaLight", "size"): lambda b: setattr(b, "size", 3.0),
    ("Light", "use_custom_distance"): lambda b: setattr(b, "use_custom_distance", True),
}


def strip(b_scene):
    strips = b_scene.sequence_editor.strips if hasattr(b_scene.sequence_editor, "strips") else None
    strips = b_scene.sequence_editor.sequences if strips is None else strips
    if bpy.app.version >= (5, 0, 0):
        strips.new_effect(name="Color", type="COLOR", channel=1, frame_start=1, length=9)
    else:
        strips.new_effect(name="Color", type="COLOR", channel=1, frame_start=1, frame_end=9)


@pytest.fixture
def stage(addon):
    """A cube, a world, a camera out of focus and a light of every kind."""
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    scene.camera.data.dof.use_dof = True
    scene.hybrid.occlusion_samples, scene.hybrid.occlusion_distance = 4, 0.0
    scene.eevee.fast_gi_distance = 2.0
    scene.eevee.use_volume_custom_range, scene.camera.data.clip_end = True, 70.0
    for kind in ("POINT", "SPOT", "SUN", "AREA"):
        light = bpy.data.objects.new(kind, bpy.data.lights.new(kind, kind))
        light.location = (1, 2, 4)
        scene.collection.objects.link(light)
    return scene


def owner(kind, name):
    """A struct of a type in the stage, for which the setting counts."""
    if name in OF_LIGHTS:
        return bpy.data.objects["SPOT"]
    scene = bpy.context.scene
    layer = scene.view_layers[0]
    lights = {b.type: b for b in bpy.data.lights if b.name in ("POINT", "SPOT", "SUN", "AREA")}
    found = {
        "SceneEEVEE": scene.eevee,
        "RaytraceEEVEE": scene.eevee.ray_tracing_options,
        "RenderSettings": scene.render,
        "ViewLayer": layer,
        "ViewLayerEEVEE": layer.eevee,
        "LayerCollection": layer.layer_collection.children[0],
        "World": scene.world,
        "Camera": scene.camera.data,
        "CameraDOFSettings": scene.camera.data.dof,
        "Object": bpy.data.objects["Cube"],
        "Material": bpy.data.materials["Material"],
        "Light": lights["SPOT"],
        "PointLight": lights["POINT"],
        "SpotLight": lights["SPOT"],
        "SunLight": lights["SUN"],
        "AreaLight": lights["AREA"],
    }
    return found[kind]


def names_of(kind):
    b_type = getattr(bpy.types, kind)
    skipped = {p.identifier for p in bpy.types.ID.bl_rna.properties} if issubclass(b_type, bpy.types.ID) else set()
    if kind in BASES:
        skipped |= {p.identifier for p in getattr(bpy.types, BASES[kind]).bl_rna.properties}
    return [p.identifier for p in b_type.bl_rna.properties if p.identifier not in skipped | OURS]


def translated(scene):
    result = translate(bpy.context.evaluated_depsgraph_get(), scene, SIZE, WINDOW)
    settings = contents(tracer_settings(scene)), tuple(moments(scene, samples=64))
    return contents(result.scene), settings, result.warnings


def test_every_setting_is_in_a_table():
    missing = [
        f"{kind}.{name}" for kind in PROPERTIES for name in names_of(kind) if not status_of(PROPERTIES[kind], name)
    ]
    assert missing == []


def test_irrelevant_settings_have_reasons():
    for table in PROPERTIES.values():
        for name, status in table.items():
            assert isinstance(status, Followed | Named | Within | Irrelevant), name
            assert not isinstance(status, Irrelevant) or len(status.why) > 10, name


def change(b_struct, kind, name):
    """Give a setting another value."""
    if (kind, name) in BY_HAND:
        BY_HAND[kind, name](b_struct)
    elif b_struct.bl_rna.properties[name].type == "ENUM":
        setattr(b_struct, name, items_of(b_struct, name)[-1])
    else:
        setattr(b_struct, name, other_value(getattr(b_struct, name)))


def set_beside(b_struct, kind, name):
    beside = {"use_nodes": False} if (kind, name) in WITHOUT_NODES else BESIDE.get((kind, name), {})
    for path, value in beside.items():
        *way, last = path.split(".")
        target = b_struct
        for step in way:
            target = bpy.context.scene if step == "scene" else getattr(target, step)
        setattr(target, last, value)


def walk(status_kind):
    return [
        (kind, name)
        for kind, table in PROPERTIES.items()
        for name in names_of(kind)
        if isinstance(status_of(table, name), status_kind)
        and name not in ELSEWHERE.get(kind, "").split()
        and bpy.app.version >= SINCE.get((kind, name), (0, 0, 0))
        and not ((kind, name) in WITHOUT_NODES and bpy.app.version >= (5, 0, 0))
    ]


@pytest.mark.parametrize(("kind", "name"), walk(Followed))
def test_what_is_followed_changes_the_scene(kind, name, stage):
    b_struct = owner(kind, name)
    set_beside(b_struct, kind, name)
    before = translated(bpy.context.scene)[:2]
    change(b_struct, kind, name)
    after = translated(bpy.context.scene)[:2]
    assert after != before


@pytest.mark.parametrize(("kind", "name"), walk(Named))
def test_what_is_named_brings_a_warning(kind, name, stage):
    b_struct, status = owner(kind, name), status_of(PROPERTIES[kind], name)
    set_beside(b_struct, kind, name)
    before = translated(bpy.context.scene)[2]
    change(b_struct, kind, name)
    new = [line for line in translated(bpy.context.scene)[2] if line not in before]
    assert len(new) == 1 and status.says in new[0], (before, new)


@pytest.mark.parametrize(("kind", "named"), [("VOLUME", True), ("SPHERE", True), ("PLANE", False)])
def test_light_probes_that_rays_do_not_replace_are_named(kind, named, stage):
    bpy.ops.object.lightprobe_add(type=kind)
    assert any("object" in line and "world" in line for line in translated(stage)[2]) == named


def test_the_kinds_of_objects_are_all_known():
    drawn_or_not = {
        *OBJECT_TYPES, "MESH", "CURVE", "SURFACE", "FONT", "CURVES", "POINTCLOUD", "LIGHT", "LIGHT_PROBE", "CAMERA",
        "EMPTY", "ARMATURE", "LATTICE", "SPEAKER", "VOLUME",
    }  # fmt: skip
    kinds = {item.identifier for item in bpy.types.Object.bl_rna.properties["type"].enum_items}
    assert kinds == drawn_or_not


def test_the_most_important_warnings_come_first(stage):
    stage.view_layers[0].use_solid = False
    tree = bpy.data.materials["Material"].node_tree
    portal, output = tree.nodes.new("ShaderNodeBsdfRayPortal"), tree.nodes["Material Output"]
    portal.inputs["Direction"].default_value = (0.0, 0.0, 1.0)
    tree.links.new(portal.outputs[0], output.inputs["Surface"])
    bpy.ops.object.light_add(type="AREA")
    bpy.context.object.data.spread = 1.0
    told = translated(stage)[2]
    found = [
        next(i for i, line in enumerate(told) if what in line)
        for what in ("EEVEE draws no surfaces", "rays go straight on", "shines to all sides")
    ]
    assert found == sorted(found)


def test_the_page_of_what_is_followed_is_up_to_date():
    assert PAGE.read_text(encoding="utf-8") == page(), "run: python -m tools.followed"
