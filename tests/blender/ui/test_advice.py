# SPDX-License-Identifier: GPL-3.0-or-later
"""What needs rays: the answer for a known scene, the list in the panel, the flags, the command."""

from __future__ import annotations

import bpy
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender import cli
from hybrid_addon.blender.ui import advice
from hybrid_addon.report.advice import shared_out

pytestmark = pytest.mark.blender


def material(name, **values):
    b_material = bpy.data.materials.new(name)
    b_material.use_nodes = True
    for socket, value in values.items():
        b_material.node_tree.nodes["Principled BSDF"].inputs[socket.replace("_", " ")].default_value = value
    return b_material


def ball(name, x, b_material):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=24, ring_count=12, location=(x, 0, 0))
    b_object = bpy.context.object
    b_object.name = name
    b_object.data.materials.append(b_material)
    return b_object


@pytest.fixture
def row(scene):
    """From left: matte, glass, a mirror that sees them and the floor behind the camera."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    bpy.ops.object.camera_add(location=(0, -12, 0), rotation=(1.5708, 0, 0))
    scene.camera = bpy.context.object
    ball("Matte", -3, material("Matte", Roughness=1.0))
    ball("Glass", 0, material("Glass", Roughness=0.0, Transmission_Weight=1.0))
    ball("Mirror", 3, material("Mirror", Roughness=0.0, Metallic=1.0))
    bpy.ops.mesh.primitive_plane_add(size=100, location=(0, 0, -3))
    bpy.context.object.name = "Floor"
    scene.render.resolution_x, scene.render.resolution_y = 320, 180
    return scene


def test_glass_and_mirror_are_suggested_with_reason_coverage_and_cost(row):
    found = hybrid.advise(row)
    assert [e["object"] for e in found["objects"]] == ["Glass", "Mirror"]
    glass, mirror = found["objects"]
    assert glass["why"][0].startswith("refracts light more than once")
    assert mirror["why"][0].startswith("mirrors what the picture does not show")
    assert all(e["suggested"] and not e["ray_traced"] for e in found["objects"])
    focal = 50 / 36 / 12  # a ball of radius 1, as a circle on the film
    assert glass["coverage"] == pytest.approx(3.1416 * focal**2 * 320 / 180, rel=0.1)
    assert glass["seconds"] > mirror["seconds"] > 0
    assert "an estimate for 320 x 180 with 16 samples" in found["basis"]


def test_the_estimate_is_the_rays_of_the_render(row):
    """The coarse picture's rays, scaled up, are those of the whole one."""
    for entry in hybrid.advise(row)["objects"]:
        row.objects[entry["object"]].hybrid.ray_traced = True
    expected = sum(entry["rays"] for entry in hybrid.advise(row)["objects"])
    row.hybrid.mode, row.hybrid.adaptive = "FULL", 0.0
    for name in ("Matte", "Floor"):
        row.objects[name].visible_camera = False
    rays = hybrid.render(row).report["rays"]
    followed = rays["camera"] + rays["reflected"] + rays["refracted"]
    camera = 320 * 180 * 16
    seen = sum(entry["coverage"] for entry in hybrid.advise(row)["objects"]) * camera
    assert expected == pytest.approx(followed - camera + seen, rel=0.1)


def test_shadows_of_clear_things_are_part_of_the_estimate(row):
    """Where they are traced; where they are not, they are suggested with what they would cost."""
    bpy.ops.object.light_add(type="SUN", location=(0, 0, 9))
    row.render.resolution_percentage, row.hybrid.samples = 25, 1
    found = hybrid.advise(row)
    assert found["shadows"] > 0 and found["notes"] == []
    row.hybrid.traced_shadows = "OFF"
    found = hybrid.advise(row)
    assert found["shadows"] == 0 and found["notes"][0].startswith("EEVEE draws the shadows of what is clear black")


def test_what_a_rehearsal_took_is_shared_out_by_rays():
    rays = {"A": (30, True), "B": (10, True), "C": (20, False)}
    entries = [{"object": n, "rays": r, "suggested": s, "ray_traced": False} for n, (r, s) in rays.items()]
    assert [entry["seconds"] for entry in shared_out(entries, 8.0)] == [6.0, 2.0, 4.0]


def test_the_list_and_one_click(row):
    assert bpy.ops.hybrid.advise() == {"FINISHED"}
    rows = bpy.context.window_manager.hybrid_advice.rows
    assert [entry.name for entry in advice.listed(bpy.context)] == ["Glass", "Mirror"]
    assert bpy.ops.hybrid.flag_advised() == {"FINISHED"}
    assert [ob.name for ob in row.objects if ob.hybrid.ray_traced] == ["Glass", "Mirror"]
    row.objects["Floor"].hybrid.ray_traced = True  # for no reason: it has an estimate without asking again
    assert {entry.name: entry.seconds for entry in advice.listed(bpy.context)}["Floor"] > 0
    bpy.ops.hybrid.advise()
    assert {entry.name: entry.why for entry in rows}["Floor"] == "nothing that EEVEE cannot draw"


def test_what_only_its_roughness_keeps_off_the_list_is_counted(row):
    """With no rays for rough surfaces a rough metal is not listed; one line says so, and what to set."""
    row.objects["Mirror"].active_material.node_tree.nodes["Principled BSDF"].inputs["Roughness"].default_value = 0.5
    assert hybrid.advise(row)["notes"] == []
    row.hybrid.rough_samples = 0
    found = hybrid.advise(row)
    assert "Mirror" in [entry["object"] for entry in found["others"] if entry["rough"]]
    (note,) = found["notes"]
    assert "rough: set Rough Samples to 1 or more" in note


def test_instances_are_advised_by_their_instancer(row):
    collection = bpy.data.collections.new("Glasses")
    collection.objects.link(row.objects["Glass"])
    row.collection.objects.unlink(row.objects["Glass"])
    for x in (-1, 1):
        empty = bpy.data.objects.new(f"Show {x}", None)
        empty.instance_type, empty.instance_collection, empty.location.x = "COLLECTION", collection, x
        row.collection.objects.link(empty)
    assert {e["object"] for e in hybrid.advise(row)["objects"]} == {"Show -1", "Show 1", "Mirror"}


def test_the_command(row, tmp_path, capfd):
    blend = tmp_path / "row.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    assert cli.main(["advise", str(blend)]) == 0
    out = capfd.readouterr().out
    assert "suggested   Glass: " in out and "all of them: about " in out
    assert cli.main(["advise", str(tmp_path / "none.blend")]) == 2


def test_a_mirror_that_eevee_draws_is_warned_of(row):
    def told():
        return any("flag what should mirror or refract them" in line for line in hybrid.plan(row)["warnings"])

    row.objects["Glass"].hybrid.ray_traced = True
    hybrid.enable(row)
    assert not told()
    row.eevee.use_raytracing = True
    assert told()
    row.hybrid.mode = "FULL"
    assert not told()


def test_of_a_car_its_windscreen_is_suggested(row):
    """A ball of which only the lower half is a mirror: that slot, not the object; its tick is the row's."""
    half = bpy.data.objects["Mirror"]
    half.data.materials.append(material("Tiles", Roughness=1.0, Specular_IOR_Level=0.0))
    for face in half.data.polygons:
        face.material_index = int(face.center.z > 0)
    assert bpy.ops.hybrid.advise() == {"FINISHED"}
    entries = {entry.name: entry.materials for entry in advice.listed(bpy.context)}
    assert entries == {"Glass": "", "Mirror": "Mirror"}
    assert bpy.ops.hybrid.flag_advised() == {"FINISHED"}
    assert bpy.data.materials["Mirror"].hybrid.ray_traced and not half.hybrid.ray_traced
    found = {entry["object"]: entry for entry in hybrid.advise(row)["objects"]}
    assert found["Mirror"]["ray_traced"] and found["Mirror"]["materials"] == ["Mirror"]
