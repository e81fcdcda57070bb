# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels: no word is cut at Blender's default width, in any language; what they say of a scene."""

from __future__ import annotations

import sys
from fnmatch import fnmatchcase
from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest

from hybrid_addon.blender import flags, session
from hybrid_addon.blender.errors import HybridError
from hybrid_addon.blender.pipeline import transmission
from hybrid_addon.blender.sync.camera import panorama_settings
from hybrid_addon.blender.sync.coverage import scene_tables
from hybrid_addon.blender.ui import advice, layout, messages, operators, panels, render_panels, translations
from hybrid_addon.blender.ui.image_editor import editor_panels
from hybrid_addon.blender.ui.translations.german import GERMAN
from tools import manual_pages

sys.path.insert(0, str(Path(__file__).parent))
import labels

pytestmark = pytest.mark.blender
PANELS = [
    cls
    for room in (panels, editor_panels, render_panels, advice)
    for cls in room.CLASSES
    if issubclass(cls, bpy.types.Panel)
]
OF_BLENDER = {
    "Samples": "Abtastwerte", "IOR": "Brechungsindex", "Roughness": "Rauheit", "Threads": "Threads",
    "Sampling": "Abtastung", "Light Paths": "Lichtpfade", "Shadows": "Schatten", "Performance": "Leistung",
    "Passes": "Durchgänge", "Advanced": "Erweitert", "Show": "Anzeigen", "Depth": "Tiefe", "Normal": "Normalen",
    "Time Limit": "Zeitlimit", "Distance": "Abstand",
}  # fmt: skip
"""Blender's own German, which the bpy module has not."""


def seen(scene, width=labels.DEFAULT_WIDTH):
    """A context in which all panels draw."""
    b_object = scene.objects["Cube"]
    return SimpleNamespace(
        scene=scene, object=b_object, material=b_object.active_material, collection=scene.collection,
        region=SimpleNamespace(width=width), engine=scene.render.engine, window_manager=bpy.context.window_manager,
        space_data=None, view_layer=scene.view_layers[0], camera=scene.camera.data,
    )  # fmt: skip


@pytest.fixture
def cube(addon):
    """The cube of the factory settings, ray traced, with all that a panel can say of it."""
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    scene.objects["Cube"].hybrid.ray_traced = True
    scene.hybrid.traced_shadows, scene.hybrid.caustics = "ON", "PHOTONS"
    scene.hybrid.enabled = True
    return scene


def german(word):
    return GERMAN.get(word) or OF_BLENDER.get(word, word)


@pytest.mark.parametrize("width", [labels.DEFAULT_WIDTH, 300.0, 500.0])
@pytest.mark.parametrize("language", ["English", "German"])
def test_no_word_of_a_panel_is_cut(cube, monkeypatch, language, width):
    if language == "German":
        monkeypatch.setattr(translations, "iface", german)
        for room in (layout, messages, panels, advice):
            monkeypatch.setattr(room, "iface", german, raising=False)
    for surface in ("MATERIAL", "CUSTOM"):
        cube.objects["Cube"].hybrid.surface = surface
        cube.objects["Cube"].active_material.hybrid.surface = surface
        context = seen(cube, width)
        assert {panel.__name__: words for panel in PANELS if (words := labels.cut(panel, context))} == {}


def test_settings_of_each_panorama_are_there_and_fit(cube):
    b_camera = cube.camera.data
    panel, context = panels.HYBRID_CAMERA_PT_panorama, seen(cube)
    assert not panel.poll(context)
    b_camera.type = "PANO"
    assert panel.poll(context) and "as EEVEE draws it" in drawn(panel, cube)
    cube.hybrid.mode = "FULL"
    b_mapping = panorama_settings(b_camera)
    for kind, groups in panels.PANORAMA_SETTINGS.items():
        b_mapping.panorama_type = kind
        kinds = b_mapping.bl_rna.properties["panorama_type"].enum_items  # Blender's own words
        assert set(labels.cut(panel, context)) <= {item.name for item in kinds}
        words = drawn(panel, cube)
        assert all(text in words and hasattr(b_mapping, name) for group in groups for name, text in group.items())


def test_the_measure_finds_what_is_cut(cube):
    """Half as wide, and in the narrow column beside the fields, words are cut."""
    assert labels.cut(render_panels.HYBRID_RENDER_PT_paths, seen(cube, 90.0))
    beside = labels.Layout()
    beside.use_property_split = True
    beside.prop(cube.hybrid, "rough_samples")
    assert beside.cut(160.0) == ["Rough Samples"] and beside.cut(400.0) == []


def test_text_is_wrapped_to_the_width_and_whole():
    text = "material 'Wine Glass': it shows the world blurred, and Donaudampfschifffahrtsgesellschaftskapitän"
    lines = list(layout.wrapped(text, 120.0))
    assert len(lines) > 3 and all(layout.text_width(line) <= 120.0 for line in lines)
    assert "".join(lines).replace(" ", "") == text.replace(" ", "")


def test_ticks_stand_for_numbers_and_sets(cube):
    settings = cube.hybrid
    settings.adaptive = 0.1
    settings.use_adaptive = False
    assert settings.adaptive == 0.0
    settings.use_adaptive = True
    assert settings.adaptive == pytest.approx(0.1) and settings.use_adaptive
    assert not settings.use_time_budget
    settings.use_time_budget = True
    assert settings.time_budget == 60.0
    settings.pass_depth = settings.pass_raster_backed = True
    assert settings.passes == {"DEPTH", "RASTER_BACKED"}
    settings.pass_depth = False
    assert settings.passes == {"RASTER_BACKED"}


def told(scene):
    layout_ = labels.Layout()
    messages.draw_state(layout_, seen(scene))
    return " ".join(part[0] for column in layout_.parts if isinstance(column, labels.Layout) for part in column.parts)


def test_a_picture_without_rays_says_why(cube):
    assert told(cube) == ""
    cube.objects["Cube"].hide_render = True
    assert told(cube).startswith("All ray traced objects are hidden in renders")
    flags.clear(cube)
    assert told(cube).startswith("No object is ray traced")
    session.of(cube.name).error = HybridError("scene 'Scene' has no camera")
    assert told(cube).startswith("The last render failed: scene 'Scene' has no camera")
    session.of(cube.name).error = None
    cube.render.engine = "CYCLES"
    assert told(cube).startswith("Hybrid needs EEVEE")
    assert bpy.ops.hybrid.use_eevee() == {"FINISHED"}
    assert told(cube).startswith("No object")


def drawn(panel, scene):
    """All words that a panel draws."""
    recorder = labels.Layout()
    panel.draw(SimpleNamespace(layout=recorder), seen(scene, 500.0))
    return " ".join(words_of(recorder))


def words_of(part):
    if isinstance(part, labels.Layout):
        return [word for inner in part.parts for word in words_of(inner)]
    return [word for word in part if isinstance(word, str)] if isinstance(part, tuple) else []


def test_own_values_of_a_material_are_told_of_its_object_too(cube):
    b_material = cube.objects["Cube"].active_material
    assert "Solid" in drawn(panels.HYBRID_OBJECT_PT_settings, cube)
    b_material.hybrid.opacity, b_material.hybrid.ior = 0.0, 2.0
    assert "Glass, IOR 2.00" in drawn(panels.HYBRID_OBJECT_PT_settings, cube)


def test_the_panel_of_materials_is_not_for_grease_pencil(cube):
    context = seen(cube)
    assert panels.HYBRID_MATERIAL_PT_settings.poll(context)
    bpy.data.materials.create_gpencil_data(context.material)
    assert not panels.HYBRID_MATERIAL_PT_settings.poll(context)


def test_labels_are_measured_once(cube, monkeypatch):
    layout.splits(300.0)
    monkeypatch.setattr(layout, "text_width", lambda text: pytest.fail(f"{text} is measured again"))
    assert layout.splits(1000.0) and not layout.splits(100.0)


def test_a_surface_is_read_once_until_blender_tells_of_a_change(cube, monkeypatch):
    monkeypatch.setattr(transmission, "bpy", SimpleNamespace(app=SimpleNamespace(background=False)))
    b_material = cube.objects["Cube"].active_material
    context = SimpleNamespace(scene=cube, view_layer=bpy.context.view_layer)
    context.view_layer.update()
    first = transmission.shown_surface(b_material, context)
    assert transmission.shown_surface(b_material, context) is first
    b_material.node_tree.nodes["Principled BSDF"].inputs["Roughness"].default_value = 0.125
    context.view_layer.update()
    assert transmission.shown_surface(b_material, context).roughness == 0.125
    loose = bpy.data.materials.new("Nobody wears it")  # no update tells of it
    assert transmission.shown_surface(loose, context) is not transmission.shown_surface(loose, context)


def test_the_first_tick_switches_hybrid_on_and_no_other_does(cube):
    flags.clear(cube)
    cube.hybrid.enabled = False
    b_object = cube.objects["Cube"]
    b_object.select_set(True)
    b_object.hybrid.ray_traced = True  # by a script: it says itself what it wants
    assert not cube.hybrid.enabled
    assert bpy.ops.hybrid.ray_traced_set() == {"FINISHED"}
    assert not cube.hybrid.enabled  # not the first
    b_object.hybrid.ray_traced = False
    assert bpy.ops.hybrid.ray_traced_set() == {"FINISHED"}
    assert cube.hybrid.enabled and b_object.hybrid.ray_traced
    flags.clear(cube)
    cube.hybrid.enabled, cube.render.engine = False, "CYCLES"
    assert bpy.ops.hybrid.surface_preset(preset="GLASS") == {"FINISHED"}
    assert not cube.hybrid.enabled


def test_a_warning_leads_to_what_it_names(cube):
    light, wearer = cube.objects["Light"], cube.objects["Cube"]
    light.name = "it's"
    assert messages.subject("""object "it's" shares a face with object 'Cube'""") == ("object", "it's")
    assert messages.subject("image 'wood.png' is missing: material 'Material' is pink") == ("material", "Material")
    assert messages.subject("EEVEE's Raytracing leaves object 'Nobody' out") is None
    assert bpy.ops.hybrid.select_subject(kind="object", name="it's") == {"FINISHED"}
    assert bpy.context.view_layer.objects.active == light and not wearer.select_get()
    assert bpy.ops.hybrid.select_subject(kind="material", name="Material") == {"FINISHED"}
    assert bpy.context.view_layer.objects.active == wearer and wearer.select_get() and not light.select_get()


def test_a_render_says_once_what_it_came_to(cube):
    own = session.of(cube.name)
    assert messages.outcome(cube) == ("INFO", "")
    own.error = HybridError("the scene has no camera")
    assert messages.outcome(cube) == ("ERROR", "The scene has no camera")
    own.error, cube.objects["Cube"].hide_render = None, True
    level, text = messages.outcome(cube)
    assert level == "WARNING" and "hidden in renders" in text


def test_what_must_fail_is_said_before_eevee_draws_and_once(cube, monkeypatch):
    posted, said = [], []
    in_window = SimpleNamespace(app=SimpleNamespace(background=False), data=bpy.data)
    monkeypatch.setattr(messages, "bpy", in_window)
    monkeypatch.setattr(messages.main_thread, "post", posted.append)
    monkeypatch.setattr(messages, "say", lambda *line: said.append(line))
    messages.render_begins(cube)
    messages.frame_begins(cube)
    assert not posted and session.of(cube.name).error is None
    cube.camera = cube.objects["Light"]
    messages.frame_begins(cube)
    messages.render_ended(cube.name)
    for work in posted:
        work()
    assert len(posted) == 2 and len(said) == 1
    assert said[0][0] == "ERROR" and "'Light', which is no camera" in said[0][1]
    messages.render_begins(cube)
    posted[0]()
    assert len(said) == 2


def test_eevees_raytracing_is_named_where_it_draws_a_mirror(cube):
    cube.eevee.use_raytracing = True
    bpy.ops.mesh.primitive_plane_add()
    bpy.context.object.data.materials.append(bpy.data.materials["Material"].copy())
    roughness = bpy.context.object.active_material.node_tree.nodes["Principled BSDF"].inputs["Roughness"]
    for value, named in ((0.9, False), (0.1, True)):
        roughness.default_value = value
        assert scene_tables._leaves_mirrors(cube.eevee) == named
    bpy.context.object.hide_render = True
    assert not scene_tables._leaves_mirrors(cube.eevee)


def test_the_manual_tells_of_every_setting_and_operator(addon, tmp_path):
    """By *Online Manual* and F1: each page is there, and the place on it."""
    manual_pages.write(tmp_path)
    prefix, pages = operators.manual_map()
    assert prefix.startswith("file://") and prefix.endswith("/manual/")
    for _, address in pages:
        name, _, place = address.partition("#")
        assert not place or f'id="{place}"' in (tmp_path / "manual" / name).read_text(encoding="utf-8"), address
    found = [f"bpy.types.HybridSceneSettings.{name}" for name in ("samples", "wipe", "pass_depth", "preview")]
    found += ["bpy.types.HybridObjectSettings.ior", "bpy.ops.hybrid.flag_advised", "bpy.ops.hybrid.ray_traced_set"]
    for name in found:
        assert any(fnmatchcase(name.lower(), pattern) for pattern, _ in pages), name
    assert bpy.ops.hybrid.manual.poll() == operators.MANUAL.is_dir()
