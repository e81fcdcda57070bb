# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels: no word is cut at Blender's default width, in any language; what they say of a scene."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest

from hybrid_addon.blender import flags, session
from hybrid_addon.blender.errors import HybridError
from hybrid_addon.blender.ui import advice, layout, messages, panels, render_panels, translations
from hybrid_addon.blender.ui.translations.german import GERMAN

sys.path.insert(0, str(Path(__file__).parent))
import labels

pytestmark = pytest.mark.blender
PANELS = [cls for room in (panels, render_panels, advice) for cls in room.CLASSES if issubclass(cls, bpy.types.Panel)]
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
        space_data=None, view_layer=scene.view_layers[0],
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
    assert told(cube).startswith("Scene 'Scene' has no camera")
    session.of(cube.name).error = None
    cube.render.engine = "CYCLES"
    assert told(cube).startswith("Hybrid needs EEVEE")
    assert bpy.ops.hybrid.use_eevee() == {"FINISHED"}
    assert told(cube).startswith("No object")
