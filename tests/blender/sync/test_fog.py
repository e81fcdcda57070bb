# SPDX-License-Identifier: GPL-3.0-or-later
"""Fog through Blender: volume nodes of worlds and boxes -> media, and what is left out by name."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from hybrid_addon.blender.render.settings import tracer_settings, with_background
from hybrid_addon.blender.scan import translated
from hybrid_addon.blender.sync import grids as grids_of_blender
from hybrid_addon.blender.sync.grids import smoke_grids
from hybrid_addon.scene import Expression, Fog, Medium, Sphere, Surface
from hybrid_addon.tracer.media.varying import VaryingMedia, sample_voxels

pytestmark = pytest.mark.blender


def tree_of(b_id):
    if bpy.app.version < (5, 0, 0):
        b_id.use_nodes = True
    return b_id.node_tree


def volume(b_id, kind, **values):
    """Link a volume shader to the output; a material then has nothing else."""
    tree = tree_of(b_id)
    if isinstance(b_id, bpy.types.Material):
        tree.nodes.clear()
        output = tree.nodes.new("ShaderNodeOutputMaterial")
    else:
        output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputWorld")
    b_node = tree.nodes.new(f"ShaderNode{kind}")
    for name, value in values.items():
        b_node.inputs[name.replace("_", " ")].default_value = value
    tree.links.new(b_node.outputs[0], output.inputs["Volume"])
    return b_node


@pytest.fixture
def of(scene):
    """What a volume node on the factory cube comes to, and what is said about it."""

    def found(kind, link=None, **values):
        b_node = volume(bpy.data.materials["Material"], kind, **values)
        if link:
            tree = bpy.data.materials["Material"].node_tree
            tree.links.new(tree.nodes.new(link[0]).outputs[0], b_node.inputs[link[1]])
        translation = translated(scene)
        assert not translation.scene.instances  # no surface, no hit
        (body,) = translation.scene.fog.bodies
        return body.medium, "\n".join(translation.warnings)

    return found


def test_scatter_and_absorption(of):
    medium, told = of("VolumeScatter", Color=(0.5, 1, 0, 1), Density=0.4, Anisotropy=0.3)
    assert medium.scattering == pytest.approx((0.2, 0.4, 0)) and medium.absorption == (0, 0, 0)
    assert medium.anisotropy == pytest.approx(0.3) and "olume" not in told
    medium, told = of("VolumeAbsorption", Color=(0.5, 1, 0, 1), Density=0.4)
    assert medium.absorption == pytest.approx((0.2, 0, 0.4)) and "olume" not in told


def test_open_bodies_and_fog_before_see_through_surfaces_are_warned_of(scene):
    volume(bpy.data.materials["Material"], "VolumeAbsorption", Density=0.4)
    settings = tracer_settings(scene)

    def told(**changes):
        traced = translated(scene).scene
        return with_background(settings, scene, replace(traced, **changes), True)

    assert told() == (settings, [])
    clear, pane = Surface(opacity=0.5, ior=1.0), Sphere("pane", (0, 0, 0), 1.0, 0, ray_traced=True)
    seen, warnings = told(surfaces=(clear,), spheres=(pane,))
    assert seen.passes >= {"background", "passed"} and "fog" in warnings[0] and "see-through" in warnings[0]
    assert told(surfaces=(clear,), spheres=(pane,), fog=Fog())[1] == []
    b_mesh = bpy.data.meshes["Cube"]
    b_mesh.clear_geometry()
    b_mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    b_mesh.materials.append(bpy.data.materials["Material"])
    assert "fog of 'Cube' is not traced" in told()[1][0]


def test_principled_volume(of):
    """Emission is not multiplied by the density."""
    values = {"Absorption_Color": (0.25, 0, 1, 1), "Emission_Strength": 0.5, "Emission_Color": (1, 0.5, 0, 1)}
    medium, told = of("VolumePrincipled", Color=(0.5, 0.5, 0.5, 1), Density=2.0, **values)
    assert medium.scattering == pytest.approx((1, 1, 1)) and medium.absorption == pytest.approx((0.5, 1, 0))
    assert medium.emission == pytest.approx((0.5, 0.25, 0)) and "olume" not in told


@pytest.mark.skipif(bpy.app.version < (5, 0, 0), reason="a node of Blender 5")
def test_volume_coefficients(of):
    medium, told = of(
        "VolumeCoefficients",
        Absorption_Coefficients=(1, 2, 3),
        Scatter_Coefficients=(4, 5, 6),
        Emission_Coefficients=(0, 1, 0),
    )
    assert (medium.absorption, medium.scattering, medium.emission) == ((1, 2, 3), (4, 5, 6), (0, 1, 0))
    assert "olume" not in told


def test_emission_glows(of):
    assert of("Emission", Color=(1, 0.5, 0, 1), Strength=0.2)[0].emission == pytest.approx((0.2, 0.1, 0))


def test_mixed_and_added(scene):
    tree = tree_of(bpy.data.materials["Material"])
    first = volume(bpy.data.materials["Material"], "VolumeScatter", Color=(1, 1, 1, 1), Density=1.0)
    second = tree.nodes.new("ShaderNodeVolumeAbsorption")
    second.inputs["Color"].default_value, second.inputs["Density"].default_value = (0, 0, 0, 1), 4.0
    for kind, expected in (("AddShader", (1, 4)), ("MixShader", (0.75, 1))):
        both = tree.nodes.new(f"ShaderNode{kind}")
        if kind == "MixShader":
            both.inputs[0].default_value = 0.25
        for b_input, part in zip(both.inputs[-2:], (first, second), strict=True):
            tree.links.new(part.outputs[0], b_input)
        output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
        tree.links.new(both.outputs[0], output.inputs["Volume"])
        (body,) = translated(scene).scene.fog.bodies
        assert (body.medium.scattering[0], body.medium.absorption[0]) == pytest.approx(expected)


@pytest.mark.parametrize("name", ["Density", "Color"])
def test_what_varies_is_an_expression_of_the_place(of, name):
    medium, told = of("VolumeScatter", ("ShaderNodeTexNoise", name), Density=5.0)
    assert isinstance(medium.scattering, Expression) and medium.absorption == (0, 0, 0) and "olume" not in told


@pytest.mark.parametrize("name", ["Density", "Color"])
def test_what_is_not_followed_is_left_out_and_named_and_never_a_black_slab(of, name):
    medium, told = of("VolumeScatter", ("ShaderNodeUVAlongStroke", name), Density=5.0)
    assert medium.is_nothing and f"'{name}' is linked to node" in told and "its volume cannot be followed" in told


@pytest.mark.parametrize(("output", "expected"), [("Density", 0.8), ("Flame", 0.0), ("Temperature", 0.0)])
def test_grids_that_are_not_there_are_what_eevee_takes_them_for(of, output, expected):
    """A mesh full of fog has none: a Principled Volume's density is its own."""
    b_node = volume(bpy.data.materials["Material"], "VolumeScatter")
    tree = bpy.data.materials["Material"].node_tree
    b_info = tree.nodes.new("ShaderNodeVolumeInfo")
    tree.links.new(b_info.outputs[output], b_node.inputs["Density"])
    (body,) = translated(bpy.context.scene).scene.fog.bodies
    assert body.medium.scattering == pytest.approx((expected,) * 3)
    assert of("VolumePrincipled", Density=2.0, Blackbody_Intensity=1.0)[0] == Medium((0.5 * 2,) * 3, (0.5 * 2,) * 3)


def test_smoke_is_read_as_eevee_reads_it():
    """Of a domain whose voxels are known: x runs fastest, a colour's density is divided out, a flame has its heat."""

    class Domain(SimpleNamespace):
        def __getattr__(self, name):
            return Values(())

    class Values(list):
        def foreach_get(self, array):
            array[:] = self

    density = np.arange(24.0) / 24
    domain = Domain(
        domain_resolution=(2, 3, 4), noise_scale=2, density_grid=Values(density), flame_grid=Values(density > 0.5),
        color_grid=Values(np.stack([density * c for c in (0.5, 1.0, 0.25, 1.0)], axis=1).ravel()),
        flame_ignition=1.5, flame_max_temp=3.0,
    )  # fmt: skip
    corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 3)]
    grids = smoke_grids(SimpleNamespace(bound_box=corners), domain)
    assert grids.widths == {"density": 1, "flame": 1, "temperature": 1, "color": 3}
    found = grids.read(grids.widths)
    assert found["density"].values[1, 2, 3, 0] == pytest.approx(23 / 24) and found["density"].values.shape == (
        2,
        3,
        4,
        1,
    )
    np.testing.assert_allclose(found["color"].values[1, 1, 1], (0.5, 1.0, 0.25), rtol=1e-6)
    assert set(np.unique(found["temperature"].values)) == {0.0, 3.0}
    np.testing.assert_allclose(found["density"].from_local @ [[-1, 1], [-1, 1], [-1, 3], [1, 1]], [[0, 1]] * 3)
    domain.density_grid = Values(())
    assert smoke_grids(SimpleNamespace(bound_box=corners), domain) is None


def test_a_smoke_domain_has_no_surface_and_liquids_have_one(scene):
    b_modifier = bpy.data.objects["Cube"].modifiers.new("Fluid", "FLUID")
    b_modifier.fluid_type = "DOMAIN"
    b_modifier.domain_settings.domain_type = "LIQUID"
    assert [i.name for i in translated(scene).scene.instances] == ["Cube"]
    b_modifier.domain_settings.domain_type = "GAS"
    assert translated(scene).scene.instances == ()


@pytest.fixture
def smoke(scene, tmp_path):
    """A volume object with a file of its own: voxels 0.5 m wide, the first of which is (-1, 0, 2)."""
    openvdb = grids_of_blender._openvdb()
    values = np.random.default_rng(1).random((3, 4, 5)).astype(np.float32) + 0.1
    grid = openvdb.FloatGrid()
    grid.copyFromArray(values, ijk=(-1, 0, 2))
    grid.name, grid.transform = "density", openvdb.createLinearTransform(voxelSize=0.5)
    openvdb.write(str(tmp_path / "smoke.vdb"), grids=[grid])
    b_volume = bpy.data.volumes.new("Smoke")
    b_volume.filepath = str(tmp_path / "smoke.vdb")
    b_object = bpy.data.objects.new("Smoke", b_volume)
    scene.collection.objects.link(b_object)
    b_object.scale = (2, 2, 2)
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    return b_object, values


def test_a_volume_object_is_what_its_file_holds(scene, smoke, monkeypatch):
    """Without material it is Blender's own, half of which scatters; twice as large it is half as dense."""
    b_object, values = smoke
    found = translated(scene)
    (body,) = found.scene.fog.bodies
    grid = body.grids["density"]
    np.testing.assert_array_equal(grid.values[1:-1, 1:-1, 1:-1, 0], values)
    assert not found.warnings and grid.values[0].max() == grid.values[..., -1, :].max() == 0
    at = np.array([[-0.5], [0.0], [1.0]])  # the middle of the first voxel
    assert sample_voxels(grid, at)[0, 0] == pytest.approx(values[0, 0, 0], rel=1e-5)
    media = VaryingMedia([(body.medium, body)], np.zeros(3), 1)
    rows = media.at(0, 2 * at, np.zeros((3, 1)))[:, 0]
    np.testing.assert_allclose(rows[:9], [*[values[0, 0, 0] / 2] * 3, *[values[0, 0, 0] / 4] * 3, 0, 0, 0], rtol=1e-5)
    assert (body.mesh.vertices.min(axis=0) < -0.5).any() and len(body.mesh.triangles) == 12
    # In blocks of two voxels it is the mean of these, at the same place.
    monkeypatch.setattr(grids_of_blender, "MOST_VOXELS", 12)
    (coarse,) = translated(scene).scene.fog.bodies
    assert coarse.grids["density"].values.shape == (4, 4, 5, 1)
    np.testing.assert_allclose(coarse.grids["density"].values[1, 1, 1, 0], values[:2, :2, :2].mean(), rtol=1e-5)
    b_object.data.render.space = "WORLD"
    (body,) = translated(scene).scene.fog.bodies
    assert VaryingMedia([(body.medium, body)], np.zeros(3), 1).at(0, 2 * at, np.zeros((3, 1)))[0, 0] > rows[0]


def test_what_modifiers_make_is_read_and_what_cannot_be_is_named(scene, smoke):
    b_object, values = smoke
    b_modifier = b_object.modifiers.new("Displace", "VOLUME_DISPLACE")
    b_modifier.strength = 0.0
    (body,) = translated(scene).scene.fog.bodies
    assert body.grids["density"].values.max() == pytest.approx(values.max(), rel=0.01)
    b_object.modifiers.clear()
    b_object.data.filepath = b_object.data.filepath + "x"
    found = translated(scene)
    assert not found.scene.fog.bodies and "object 'Smoke': its volume cannot be read" in found.warnings[0]


def test_a_worlds_fog_lets_nothing_of_the_world_and_of_suns_through(scene):
    """Both are infinitely far, as EEVEE has it; fog that only glows hides nothing."""
    bpy.data.objects["Light"].data.type = "SUN"
    volume(scene.world, "Emission", Strength=0.1)
    before = translated(scene).scene
    assert before.lights and any(before.world.radiance) and before.fog.world.emission == pytest.approx((0.1,) * 3)
    volume(scene.world, "VolumeScatter", Density=0.01)
    after = translated(scene).scene
    assert not after.lights and after.world.radiance == (0, 0, 0) and after.fog.world.dims


def test_fog_in_one_of_several_material_slots_is_a_body_of_its_own(scene):
    """A cube of fog joined to a solid one: EEVEE draws both. A slot that no face wears is nothing."""
    volume(bpy.data.materials["Material"], "VolumeScatter", Density=0.25)
    bpy.ops.mesh.primitive_cube_add(size=1, location=(3, 0, 0))
    solid, cube = bpy.context.object, bpy.data.objects["Cube"]
    solid.data.materials.append(bpy.data.materials.new("Solid"))
    cube.select_set(True)
    bpy.context.view_layer.objects.active = cube
    bpy.ops.object.join()
    found = translated(scene)
    (body,), (instance,) = found.scene.fog.bodies, found.scene.instances
    rest = found.scene.meshes[instance.mesh]
    assert (len(body.mesh.triangles), len(rest.triangles)) == (12, 12)
    assert abs(body.mesh.vertices[body.mesh.triangles]).max() == 1
    assert rest.vertices[rest.triangles][..., 0].min() == pytest.approx(2.5)
    assert body.medium.scattering == pytest.approx((0.2,) * 3) and found.warnings == ()
    cube.data.polygons.foreach_set("material_index", [1] * len(cube.data.polygons))
    cube.data.update()
    found = translated(scene).scene
    assert not found.fog.bodies and len(found.meshes[found.instances[0].mesh].triangles) == 24


def test_ticked_fog_is_named(scene):
    volume(bpy.data.materials["Material"], "VolumeScatter", Density=0.01)
    bpy.data.objects["Cube"].hybrid.ray_traced = True
    assert "untick Ray Traced" in "\n".join(translated(scene).warnings)


def test_the_settings_of_eevees_volumes(scene):
    scene.eevee.use_volume_custom_range = True
    scene.eevee.volumetric_start, scene.eevee.volumetric_end = 3, 40
    assert (translated(scene).scene.fog.start, translated(scene).scene.fog.reach) == (3, 40)
    scene.eevee.use_volume_custom_range = False
    scene.camera.data.clip_start, scene.camera.data.clip_end = 0.5, 60
    assert (translated(scene).scene.fog.start, translated(scene).scene.fog.reach) == (0.5, 60)
    assert not translated(scene).scene.fog.shadows
    scene.eevee.use_volumetric_shadows = True
    assert translated(scene).scene.fog.shadows
    bpy.data.objects["Light"].data.volume_factor = 0.25
    assert translated(scene).scene.lights[0].volume == 0.25
