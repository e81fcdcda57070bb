# SPDX-License-Identifier: GPL-3.0-or-later
"""Node trees to surfaces: the numbers of each shader, the Custom rule, and links that are looked through."""

from __future__ import annotations

from dataclasses import fields

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from hybrid_addon.blender.sync import Warnings
from hybrid_addon.blender.sync.image import Images
from hybrid_addon.blender.sync.lobes import RADIUS
from hybrid_addon.blender.sync.material import Surfaces, customised, translate_material, warn_of_roughness
from hybrid_addon.blender.sync.settings import NOTHING_OF_ITS_OWN, CustomSurface
from hybrid_addon.blender.sync.sums import added, averaged, shares
from hybrid_addon.blender.sync.sums import mixed as blend
from hybrid_addon.blender.sync.texture import FrameFacts
from hybrid_addon.expressions import reads_of_instance, reads_ray, walk
from hybrid_addon.scene import BLACK, WHITE, Expression, Surface

pytestmark = pytest.mark.blender
GOLD = (1.0, 0.75, 0.25)


class Material:
    """A material whose output is fed by the nodes that a test adds."""

    def __init__(self):
        self.b_material = bpy.data.materials.new("Stuff")
        if bpy.app.version < (5, 0, 0):
            self.b_material.use_nodes = True
        self.tree = self.b_material.node_tree
        self.tree.nodes.clear()
        self.output = self.add("ShaderNodeOutputMaterial")
        self.warn = Warnings()

    def add(self, kind, **values):
        b_node = self.tree.nodes.new(kind)
        for name, value in values.items():
            b_node.inputs[name.replace("_", " ")].default_value = value
        return b_node

    def link(self, b_output, b_input):
        self.tree.links.new(b_output, b_input)

    def shade(self, b_node):
        self.link(b_node.outputs[0], self.output.inputs["Surface"])
        return self.surface()

    def surface(self):
        return translate_material(self.b_material, Images(self.warn), self.warn, FrameFacts())


@pytest.fixture
def material(scene):
    return Material()


def principled(material, **values):
    return material.shade(material.add("ShaderNodeBsdfPrincipled", **values))


@pytest.mark.parametrize(
    ("kind", "value", "light"),
    [("ShaderNodeRGB", (0.1, 0.5, 0.9, 1), (0.1, 0.5, 0.9)), ("ShaderNodeValue", 0.6, (0.6, 0.6, 0.6))],
)
@pytest.mark.parametrize("mixed", [False, True])
def test_a_color_linked_to_a_shader_socket_is_emission(material, kind, value, light, mixed):
    b_node = material.tree.nodes.new(kind)
    b_node.outputs[0].default_value = value
    if mixed:
        b_mix = material.add("ShaderNodeMixShader")
        for position in (1, 2):
            material.link(b_node.outputs[0], b_mix.inputs[position])
        b_node = b_mix
    surface = material.shade(b_node)
    assert surface.emission == pytest.approx(light)
    assert (surface.base_color, surface.opacity, list(material.warn)) == (BLACK, 1.0, [])


def test_a_texture_linked_to_a_shader_socket_is_emission(material):
    surface = material.shade(material.add("ShaderNodeTexChecker"))
    assert [e.operation for e in walk(surface.emission)]
    assert not list(material.warn)


def test_a_dielectric_is_opaque_with_its_fresnel_highlight(material):
    surface = principled(material, Base_Color=(0.1, 0.2, 0.3, 1), IOR=1.5, Roughness=0.3)
    assert surface.name == "Stuff"
    assert surface.base_color == pytest.approx((0.1, 0.2, 0.3))
    assert (surface.reflectivity, surface.opacity) == (0.0, 1.0)
    assert surface.specular == pytest.approx((0.04, 0.04, 0.04), rel=1e-5)
    assert surface.roughness == pytest.approx(0.3)
    assert (surface.reflection_tint, surface.transmission_tint, surface.emission) == (WHITE, WHITE, BLACK)
    assert list(material.warn) == []


def test_specular_level_and_tint_scale_the_highlight(material):
    surface = principled(material, IOR=1.5, Specular_IOR_Level=0.25, Specular_Tint=(1, 0.5, 0, 1))
    assert surface.specular == pytest.approx((0.02, 0.01, 0.0), rel=1e-5)


def test_a_metal_is_a_coloured_mirror(material):
    surface = principled(material, Base_Color=(*GOLD, 1), Metallic=1.0, Roughness=0.0)
    assert (surface.reflectivity, surface.reflection_tint) == (1.0, GOLD)
    assert list(material.warn) == []
    rough = principled(material, Metallic=1.0, Roughness=0.5)
    warn_of_roughness([rough], material.warn)
    assert "its roughness of 0.5 is not traced" in next(iter(material.warn))


def test_glass_tints_each_crossing_by_the_root_of_the_base_colour(material):
    surface = principled(material, Base_Color=(0.25, 1, 0.64, 1), Transmission_Weight=1.0, IOR=1.33, Roughness=0.0)
    assert (surface.reflectivity, surface.opacity) == (0.0, 0.0)
    assert surface.ior == pytest.approx(1.33)
    assert surface.transmission_tint == pytest.approx((0.5, 1.0, 0.8))
    assert surface.reflection_tint == WHITE


def test_alpha_lets_light_straight_through(material):
    surface = principled(material, Alpha=0.25, Emission_Color=(1, 1, 1, 1), Emission_Strength=8.0)
    assert shares(surface) == pytest.approx((0.0, 0.25, 0.75))
    assert surface.ior == 1.0
    assert surface.transmission_tint == WHITE
    assert surface.emission == pytest.approx((2, 2, 2))


def test_alpha_metal_and_transmission_share_the_light_out(material):
    surface = principled(material, Alpha=0.5, Metallic=0.5, Base_Color=(*GOLD, 1), Roughness=0.0)
    assert shares(surface) == pytest.approx((0.25, 0.25, 0.5))
    surface = principled(material, Metallic=0.5, Transmission_Weight=0.5, Roughness=0.0)
    assert shares(surface) == pytest.approx((0.5, 0.25, 0.25))
    assert list(material.warn) == []
    surface = principled(material, Alpha=0.75, Transmission_Weight=1.0, Roughness=0.0, IOR=1.7)
    assert [c.weight for c in surface.closures] == pytest.approx([0.75, 0.25])
    assert [shares(c.surface) for c in surface.closures] == [(0, 0, 1), (0, 0, 1)]
    assert [c.surface.ior for c in surface.closures] == pytest.approx([1.7, 1.0])


def test_emission_is_colour_times_strength(material):
    surface = material.shade(material.add("ShaderNodeEmission", Color=(1, 0.5, 0.25, 1), Strength=4.0))
    assert surface.emission == pytest.approx((4, 2, 1))
    assert surface.base_color == BLACK


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        ("ShaderNodeBsdfGlass", {"shares": (0, 0, 1), "transmission_tint": GOLD, "ior": 1.6}),
        ("ShaderNodeBsdfRefraction", {"shares": (0, 0, 1), "transmission_tint": GOLD, "ior": 1.6}),
        ("ShaderNodeBsdfTransparent", {"shares": (0, 0, 1), "transmission_tint": GOLD, "ior": 1.0}),
        ("ShaderNodeBsdfAnisotropic", {"shares": (1, 0, 0), "reflection_tint": GOLD}),
        ("ShaderNodeBsdfDiffuse", {"shares": (0, 1, 0), "base_color": GOLD, "specular": BLACK}),
        ("ShaderNodeBsdfTranslucent", {"shares": (0, 1, 0), "base_color": GOLD, "translucent": True}),
        ("ShaderNodeBsdfToon", {"shares": (0, 1, 0), "base_color": GOLD}),
        ("ShaderNodeBsdfHair", {"shares": (0, 1, 0), "base_color": GOLD}),
        ("ShaderNodeBsdfHairPrincipled", {"shares": (0, 1, 0), "base_color": GOLD}),
        ("ShaderNodeBsdfSheen", {"shares": (0, 1, 0), "base_color": BLACK, "sheen": 1.0, "sheen_tint": GOLD}),
        ("ShaderNodeHoldout", {"shares": (0, 1, 0), "base_color": BLACK}),
    ],
)
def test_the_other_shaders(material, kind, expected):
    b_node = material.add(kind)
    for name, value in (("Color", (*GOLD, 1)), ("IOR", 1.6), ("Roughness", 0.0)):
        if name in b_node.inputs:
            b_node.inputs[name].default_value = value
    surface = material.shade(b_node)
    assert shares(surface) == expected.pop("shares")
    for name, value in expected.items():
        assert getattr(surface, name) == pytest.approx(value), name
    assert bool(list(material.warn)) is (kind == "ShaderNodeHoldout")


def test_an_unknown_shader_is_grey_and_named(material):
    surface = material.shade(material.add("ShaderNodeVolumeAbsorption"))
    assert surface.base_color == (0.8, 0.8, 0.8)
    assert "material 'Stuff': node 'Volume Absorption'" in next(iter(material.warn))


def test_nothing_linked_is_black(material):
    assert material.surface().base_color == BLACK
    material.tree.nodes.clear()
    assert material.surface().base_color == BLACK
    assert "no active output" in next(iter(material.warn))


# ------------------------------------------------------------------------------------------------ mixing


def mixed(material, first, second, factor):
    b_mix = material.add("ShaderNodeMixShader")
    b_mix.inputs[0].default_value = factor
    material.link(first.outputs[0], b_mix.inputs[1])
    material.link(second.outputs[0], b_mix.inputs[2])
    return material.shade(b_mix)


def test_transparent_mixed_with_diffuse_is_exact(material):
    clear = material.add("ShaderNodeBsdfTransparent", Color=(0.5, 1, 1, 1))
    surface = mixed(material, clear, material.add("ShaderNodeBsdfDiffuse", Color=(*GOLD, 1)), 0.25)
    (share, pane), (rest, cloth) = ((c.weight, c.surface) for c in surface.closures)
    assert (share, rest) == pytest.approx((0.75, 0.25))
    assert cloth.base_color == pytest.approx(GOLD)
    assert pane.transmission_tint == pytest.approx((0.5, 1, 1))
    assert pane.ior == 1.0
    assert list(material.warn) == []


@pytest.mark.parametrize(("factor", "expected"), [(0.0, 1.0), (1.0, 0.0)])
def test_a_factor_of_0_or_1_takes_one_side(material, factor, expected):
    glossy = material.add("ShaderNodeBsdfAnisotropic", Roughness=0.0)
    assert mixed(material, glossy, material.add("ShaderNodeBsdfDiffuse"), factor).reflectivity == expected


def test_two_glasses_are_a_sum_of_both(material):
    thin = material.add("ShaderNodeBsdfGlass", IOR=1.2, Roughness=0.0)
    surface = mixed(material, thin, material.add("ShaderNodeBsdfGlass", IOR=1.8, Roughness=0.0), 0.75)
    assert [c.weight for c in surface.closures] == pytest.approx([0.25, 0.75])
    assert [c.surface.ior for c in surface.closures] == pytest.approx([1.2, 1.8])
    assert list(material.warn) == []


def test_sums_within_sums_are_one_list():
    first, second = Surface(reflectivity=0.3, base_color=(1, 0, 0)), Surface(opacity=0.9, base_color=(0, 1, 0))
    inner = blend(first, second, 0.4)
    outer = added(inner, blend(first, inner, 0.5))
    assert [c.surface for c in outer.closures] == [first, second]
    assert [c.weight for c in outer.closures] == pytest.approx([0.6 + 0.5 + 0.3, 0.4 + 0.2])


def test_what_one_closure_holds_is_one():
    red, green = Surface(base_color=(1, 0, 0)), Surface(base_color=(0, 1, 0))
    assert blend(red, green, 0.25).base_color == pytest.approx((0.75, 0.25, 0))
    assert added(red, green).base_color == (1, 1, 0)
    assert blend(red, red, 0.25).closures == ()
    glow = Surface(base_color=BLACK, emission=(1, 2, 3))
    assert added(glow, glow).emission == (2, 4, 6)
    assert added(red, glow).emission == (1, 2, 3) and added(red, glow).base_color == (1, 0, 0)
    mirror = Surface(reflectivity=1.0)
    assert len(blend(mirror, glow, 0.5).closures) == len(blend(red, mirror, 0.5).closures) == 2
    assert blend(mirror, Surface(base_color=BLACK), 0.25).closures[0].weight == 0.75  # nothing is no closure
    assert added(mirror, mirror).closures[0].weight == 2.0


def test_custom_values_of_a_sum_keep_its_colours():
    """Each colour is that of what mirrors, shows or lets through; of two that do, their mean by share."""
    gold = Surface(reflectivity=1.0, reflection_tint=GOLD)
    red, green = Surface(base_color=(1, 0, 0)), Surface(base_color=(0, 1, 0))
    blue = Surface(opacity=0.0, transmission_tint=(0, 0, 1))
    for whole in (blend(blend(red, gold, 0.5), blue, 0.25), added(added(gold, blue), red)):
        one = averaged(whole)
        assert (one.reflection_tint, one.base_color, one.transmission_tint) == (GOLD, (1, 0, 0), (0, 0, 1))
        own = customised(whole, CustomSurface((0.25, 0.5, 1.3)))
        assert not own.closures and shares(own) == pytest.approx((0.25, 0.375, 0.375))
    mixed_twice = averaged(blend(blend(red, gold, 0.5), blend(green, gold, 0.5), 0.25))
    assert mixed_twice.base_color == pytest.approx((0.75, 0.25, 0))


def test_alpha_and_transmission_together_are_a_sum(material):
    b_node = material.add("ShaderNodeBsdfPrincipled", **{"Transmission Weight": 1.0, "Alpha": 0.25, "IOR": 1.3})
    surface = material.shade(b_node)
    (glass_weight, glass), (clear_weight, clear) = ((c.weight, c.surface) for c in surface.closures)
    assert (glass_weight, clear_weight) == pytest.approx((0.25, 0.75))
    assert glass.ior == pytest.approx(1.3) and shares(glass) == (0, 0, 1)
    assert clear.ior == 1.0 and shares(clear) == (0, 0, 1)
    assert list(material.warn) == []


def test_an_ior_that_varies(material):
    b_node = material.add("ShaderNodeBsdfGlass", Roughness=0.0)
    b_facing = material.add("ShaderNodeLayerWeight")
    material.link(b_facing.outputs["Facing"], b_node.inputs["IOR"])
    assert isinstance(material.shade(b_node).ior, Expression)
    assert list(material.warn) == []


def test_emission_adds_to_another_shader(material):
    b_add = material.add("ShaderNodeAddShader")
    material.link(material.add("ShaderNodeEmission", Strength=2.0).outputs[0], b_add.inputs[0])
    material.link(material.add("ShaderNodeBsdfGlass", IOR=1.4, Roughness=0.0).outputs[0], b_add.inputs[1])
    surface = material.shade(b_add)
    assert surface.emission == pytest.approx((2, 2, 2))
    assert shares(surface) == (0, 0, 1)
    assert list(material.warn) == []


# ------------------------------------------------------------------------------------------------ links


def test_value_and_colour_nodes_reroutes_and_mutes_are_looked_through(material):
    b_node = material.add("ShaderNodeBsdfPrincipled", Roughness=0.1)
    b_value, b_rgb, b_reroute = (material.add(kind) for kind in ("ShaderNodeValue", "ShaderNodeRGB", "NodeReroute"))
    b_value.outputs[0].default_value, b_rgb.outputs[0].default_value = 0.75, (*GOLD, 1)
    b_invert = material.add("ShaderNodeInvert")
    b_invert.mute = True
    material.link(b_value.outputs[0], b_node.inputs["Metallic"])
    material.link(b_rgb.outputs[0], b_invert.inputs["Color"])
    material.link(b_invert.outputs[0], b_reroute.inputs[0])
    material.link(b_reroute.outputs[0], b_node.inputs["Base Color"])
    surface = material.shade(b_node)
    assert surface.reflectivity == 0.75
    assert surface.base_color == GOLD
    assert list(material.warn) == []


def test_a_muted_node_that_nothing_is_linked_to_is_as_if_not_linked(material):
    """EEVEE and Cycles show the input's own colour, not the muted node's."""
    b_node, b_hue = (
        material.add("ShaderNodeEmission"),
        material.add("ShaderNodeHueSaturation", Color=(0.7, 0.2, 0.1, 1)),
    )
    b_node.inputs["Color"].default_value, b_hue.mute = (*GOLD, 1), True
    material.link(b_hue.outputs[0], b_node.inputs["Color"])
    assert material.shade(b_node).emission == pytest.approx(GOLD)


@pytest.mark.parametrize(("fed", "expected"), [(2.5, 1.0), (-1.0, 0.0)])
def test_numbers_that_a_socket_would_not_allow_are_clamped(material, fed, expected):
    b_value, b_node = material.add("ShaderNodeValue"), material.add("ShaderNodeBsdfPrincipled")
    b_value.outputs[0].default_value = fed
    for name in ("Metallic", "Roughness", "IOR"):
        material.link(b_value.outputs[0], b_node.inputs[name])
    surface = material.shade(b_node)
    assert (surface.reflectivity, surface.roughness) == (expected, expected)
    assert surface.ior == (2.5 if fed > 0 else pytest.approx(1e-5))


def test_node_groups_are_looked_into_and_out_of(material):
    b_group = bpy.data.node_groups.new("Paint", "ShaderNodeTree")
    b_group.interface.new_socket("Shininess", in_out="INPUT", socket_type="NodeSocketFloat")
    b_group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    b_in, b_out, b_inner = (
        b_group.nodes.new(kind) for kind in ("NodeGroupInput", "NodeGroupOutput", "ShaderNodeBsdfPrincipled")
    )
    b_inner.inputs["Roughness"].default_value = 0.0
    b_group.links.new(b_in.outputs[0], b_inner.inputs["Metallic"])
    b_group.links.new(b_inner.outputs[0], b_out.inputs[0])
    b_node = material.add("ShaderNodeGroup")
    b_node.node_tree = b_group
    b_node.inputs["Shininess"].default_value = 0.5
    assert material.shade(b_node).reflectivity == 0.5  # the group node's own socket
    b_value = material.add("ShaderNodeValue")
    b_value.outputs[0].default_value = 0.875
    material.link(b_value.outputs[0], b_node.inputs["Shininess"])
    assert material.surface().reflectivity == 0.875  # what is linked to the group node
    assert list(material.warn) == []


def test_groups_within_groups(material):
    b_inner, b_outer = (bpy.data.node_groups.new(name, "ShaderNodeTree") for name in ("Inner", "Outer"))
    for b_group in (b_inner, b_outer):
        b_group.interface.new_socket("Value", in_out="INPUT", socket_type="NodeSocketFloat")
        b_group.interface.new_socket("Value", in_out="OUTPUT", socket_type="NodeSocketFloat")
    b_group.interface.new_socket("Other", in_out="OUTPUT", socket_type="NodeSocketFloat")
    for b_group in (b_inner, b_outer):
        b_in, b_out = b_group.nodes.new("NodeGroupInput"), b_group.nodes.new("NodeGroupOutput")
        b_group.links.new(b_in.outputs[0], b_out.inputs[0])
    b_nested = b_outer.nodes.new("ShaderNodeGroup")
    b_nested.node_tree = b_inner
    b_nested.inputs[0].default_value = 0.125
    b_outer.links.new(b_in.outputs[0], b_nested.inputs[0])
    b_outer.links.new(b_nested.outputs[0], b_out.inputs["Other"])
    b_node = material.add("ShaderNodeGroup")
    b_node.node_tree = b_outer
    b_node.inputs[0].default_value = 0.375
    b_shader = material.add("ShaderNodeBsdfPrincipled", Roughness=0.0)
    material.link(b_node.outputs["Other"], b_shader.inputs["Metallic"])
    assert material.shade(b_shader).reflectivity == 0.375


def test_light_path_is_asked_of_each_ray(material):
    b_path, b_shader = material.add("ShaderNodeLightPath"), material.add("ShaderNodeEmission")
    for output, asks in (("Is Shadow Ray", True), ("Ray Length", True), ("Is Volume Scatter Ray", False)):
        material.link(b_path.outputs[output], b_shader.inputs["Color"])
        assert reads_ray(material.shade(b_shader)) == asks
    assert list(material.warn) == []


def test_material_index_is_a_number_and_the_rest_of_object_info_is_the_instances(material):
    b_info, b_shader = material.add("ShaderNodeObjectInfo"), material.add("ShaderNodeEmission")
    material.b_material.pass_index = 3
    for output, emission, read in (
        ("Material Index", (3.0, 3.0, 3.0), set()),
        ("Random", None, {"random"}),
        ("Color", None, {"color"}),
    ):
        material.link(b_info.outputs[output], b_shader.inputs["Color"])
        surface = material.shade(b_shader)
        assert reads_of_instance(surface) == read
        assert emission is None or surface.emission == emission


def test_a_constant_on_a_normal_input_is_the_surfaces_normal(material):
    b_shader, b_normal = material.add("ShaderNodeBsdfDiffuse"), material.add("ShaderNodeCombineXYZ", Z=1.0)
    assert material.shade(b_shader).normal is None
    material.link(b_normal.outputs[0], b_shader.inputs["Normal"])
    normal = material.shade(b_shader).normal
    assert (normal.operation, normal.inputs) == ("held", ((0.0, 0.0, 1.0),))


def test_links_that_are_not_followed_are_named_and_the_default_is_used(material):
    b_node = material.add("ShaderNodeBsdfPrincipled", Metallic=0.25, Roughness=0.1)
    b_wires = material.add("ShaderNodeWireframe")
    b_wires.label = "Scratches"
    material.link(b_wires.outputs[0], b_node.inputs["Metallic"])
    assert material.shade(b_node).reflectivity == 0.25
    assert list(material.warn) == [
        "material 'Stuff': 'Metallic' is linked to node 'Scratches' (Wireframe), which is not followed; "
        "its own value is used: bake it to an image"
    ]


def test_a_volume_that_scatters_is_warned_of(material):
    b_node = material.add("ShaderNodeBsdfPrincipled", Coat_Weight=0.5)
    material.link(material.add("ShaderNodeVolumeScatter").outputs[0], material.output.inputs["Volume"])
    material.shade(b_node)
    assert "scattering" in "\n".join(material.warn)


def test_subsurface_is_a_share_and_a_radius_in_metres(material):
    b_node = material.add("ShaderNodeBsdfPrincipled", Subsurface_Weight=0.5, Subsurface_Scale=0.2)
    b_node.inputs["Subsurface Radius"].default_value = (1.0, 0.5, 0.25)
    surface = material.shade(b_node)
    assert surface.scatter == 0.5
    assert surface.scatter_radius == pytest.approx([RADIUS * 0.2, RADIUS * 0.1, RADIUS * 0.05])
    assert material.shade(material.add("ShaderNodeSubsurfaceScattering", Scale=0.0)).scatter == 0.0
    assert list(material.warn) == []


def test_a_shader_tree_in_a_loop_ends(material):
    first, second = material.add("NodeReroute"), material.add("NodeReroute")
    material.link(first.outputs[0], second.inputs[0])
    material.link(second.outputs[0], first.inputs[0])
    material.link(second.outputs[0], material.output.inputs["Surface"])
    assert material.surface().base_color == BLACK


# ------------------------------------------------------------------------------------------------ Custom


def test_a_grey_object_becomes_a_lossless_mirror_or_clear_glass(material):
    grey = principled(material)
    mirror = customised(grey, CustomSurface((1.0, 1.0, 1.5)))
    assert (mirror.reflectivity, mirror.reflection_tint) == (1.0, WHITE)
    glass = customised(grey, CustomSurface((0.0, 0.0, 1.5)))
    assert shares(glass) == (0, 0, 1)
    assert (glass.transmission_tint, glass.ior) == (WHITE, 1.5)
    assert glass.base_color == grey.base_color


def test_gold_stays_gold_and_green_glass_stays_green(material):
    gold = principled(material, Base_Color=(*GOLD, 1), Metallic=1.0, Roughness=0.0)
    assert customised(gold, CustomSurface((0.5, 1.0, 1.5))).reflection_tint == GOLD
    green = principled(material, Base_Color=(0.04, 0.81, 0.04, 1), Transmission_Weight=1.0, Roughness=0.0)
    assert customised(green, CustomSurface((0.0, 0.5, 1.0))).transmission_tint == pytest.approx((0.2, 0.9, 0.2))


def test_each_pair_of_material_and_settings_is_one_surface(material):
    warn = Warnings()
    surfaces = Surfaces(Images(warn), warn, FrameFacts())
    custom = CustomSurface((1.0, 1.0, 1.5))
    nothing = CustomSurface(None)
    pairs = [(material.b_material, nothing), (material.b_material, custom), (None, nothing), (None, custom)]
    assert [surfaces.index_of(*pair) for pair in pairs + pairs] == [0, 1, 2, 3] * 2
    assert [surface.reflectivity for surface in surfaces.surfaces] == [0, 1, 0, 1]


@pytest.mark.skipif(bpy.app.version >= (5, 0, 0), reason="the switch is gone from Blender 5 on")
def test_without_nodes_the_viewport_values_count(material):
    material.b_material.use_nodes = False
    material.b_material.diffuse_color, material.b_material.metallic = (*GOLD, 1), 1.0
    surface = material.surface()
    assert (surface.reflectivity, surface.reflection_tint) == (1.0, GOLD)
    assert np.isclose(surface.specular[0], 0.08 * material.b_material.specular_intensity)


def test_coordinates_of_another_object_are_its_own(material):
    b_empty = bpy.data.objects.new("Place", None)
    b_empty.matrix_world = Matrix(((2, 0, 0, 1), (0, 1, 0, 5), (0, 0, 1, 0), (0, 0, 0, 1)))
    b_node, b_place = material.add("ShaderNodeBsdfDiffuse"), material.add("ShaderNodeTexCoord")
    b_place.object = b_empty
    material.link(b_place.outputs["Object"], b_node.inputs["Color"])
    moved, position = walk(material.shade(b_node).base_color)
    assert (moved.operation, position.data, list(material.warn)) == ("affine", "position", [])
    assert moved.data @ (3, 5, 7, 1) == pytest.approx((1, 0, 7))


def test_an_object_without_material_looks_as_with_a_new_one(scene):
    """As EEVEE draws it, to the last digit of its picture."""
    b_material = bpy.data.materials.new("New")
    if b_material.node_tree is None:
        b_material.use_nodes = True
    warn = Warnings()
    new = translate_material(b_material, Images(warn), warn, FrameFacts())
    surfaces = Surfaces(Images(warn), warn, FrameFacts())
    bare = surfaces.surfaces[surfaces.index_of(None, NOTHING_OF_ITS_OWN)]
    for field in fields(bare):
        if field.name != "name":
            assert getattr(bare, field.name) == pytest.approx(getattr(new, field.name)), field.name
