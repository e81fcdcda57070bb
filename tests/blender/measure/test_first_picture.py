# SPDX-License-Identifier: GPL-3.0-or-later
"""The fifteen first pictures: whole scenes with nothing set but ticks, drawn once, compared where rays drew."""

from __future__ import annotations

import json

import pytest

bpy = pytest.importorskip("bpy", reason="needs the bpy module")
import bmesh  # noqa: E402  (only importable next to bpy)

from hybrid_addon.settings_table import RENDER  # noqa: E402
from tools.first_picture import draw  # noqa: E402
from tools.first_picture.__main__ import SCENES, tabulated  # noqa: E402

pytestmark = pytest.mark.blender

TICKED = {
    "window_pane": {"Pane"},
    "pool": {"Water"},
    "wine_glass": {"Wine glass", "Wine"},
    "chrome_logo": {"Logo"},
    "mirror": {"Mirror"},
    "spectacles": {"Lens", "Rim", "Temple", "Bridge"},
    "skin_beside_glass": {"Wine glass", "Glass ball"},
    "car_paint": {"Body"},
    "teapot": {"Pot", "Lid", "Spout", "Handle"},
    "frosted": {"Pane", "Cup"},
    "studio_balls": {"Chrome ball", "Lacquer ball", "Glass ball"},
    "bottle": {"Bottle", "Liquid", "Stopper"},
    "gems": {"Diamond", "Ruby"},
    "hair_behind_glass": {"Wine glass"},
    "smoke_behind_glass": {"Wine glass"},
}


@pytest.fixture(params=sorted(SCENES))
def name(request, addon):
    SCENES[request.param]()
    yield request.param
    bpy.ops.wm.read_factory_settings()


def test_only_ticks_are_set_and_what_is_ticked_is_whole(name):
    scene = bpy.context.scene
    assert not [setting.name for setting in RENDER if scene.hybrid.is_property_set(setting.name)]
    ticked = {obj for obj in scene.objects if obj.hybrid.ray_traced}
    assert {obj.name.split(".")[0] for obj in ticked} == TICKED[name]
    assert all(obj.hybrid.surface == "MATERIAL" for obj in ticked)
    assert scene.camera is not None and scene.eevee.use_raytracing
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for obj in ticked:
        skin = bmesh.new()
        skin.from_mesh(obj.evaluated_get(depsgraph).to_mesh())
        if obj.type == "MESH":  # letters have seams
            assert all(len(edge.link_faces) == 2 for edge in skin.edges), obj.name
            assert skin.calc_volume(signed=True) > 0, obj.name
        skin.free()


@pytest.mark.render
def test_a_scene_is_drawn_once_and_cycles_samples_add_up(addon, tmp_path, monkeypatch):
    size, folder = (24, 18), tmp_path / "studio_balls"
    found = draw.Drawing(SCENES["studio_balls"], size, 1, folder).draw(2)
    assert found["cycles samples"] == 2 and 0.1 < found["ray traced"] < 0.5
    assert found["hybrid rmse"] > 0 and found["noise"] > 0
    assert (folder / "sheet.png").exists()

    drawn = []
    real = draw._rendered
    monkeypatch.setattr(draw, "_rendered", lambda scene: (drawn.append(scene.render.engine), real(scene))[1])
    monkeypatch.setattr(draw.hybrid, "render", None)  # fails if it were called
    again = draw.Drawing(SCENES["studio_balls"], size, 1, folder).draw(5)
    assert again["cycles samples"] == 5 and set(drawn) == {"CYCLES"}
    assert again["eevee wall"] == found["eevee wall"]
    assert json.loads((folder / "notes.json").read_text())["cycles"]["chunks"] == [1, 1, 3]
    assert "studio balls" in tabulated({"studio_balls": again}).markdown()
    bpy.ops.wm.read_factory_settings()
