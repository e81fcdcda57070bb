# SPDX-License-Identifier: GPL-3.0-or-later
"""Single closures: thin films, brushed metals, coats with normals of their own, sheets that light shines through."""

import bpy
import pytest

from hybrid_addon.blender.sync.lobes import FILMS_ON_METAL
from hybrid_addon.scene import BLACK, Expression

from .test_material import Material, principled

pytestmark = pytest.mark.blender
THIN_WALL = bpy.app.version >= (5, 2, 0)


@pytest.fixture
def material(scene):
    return Material()


def test_a_film_has_its_thickness_and_ior(material):
    surface = principled(material, Thin_Film_Thickness=420.0, Thin_Film_IOR=1.7)
    assert (surface.film, surface.film_ior) == pytest.approx((420.0, 1.7))
    assert list(material.warn) == []
    assert principled(material, Thin_Film_IOR=1.7).film == 0.0


def test_films_lie_on_metal_as_in_cycles_of_that_version(material):
    surface = principled(material, Metallic=1.0, Thin_Film_Thickness=420.0)
    assert surface.film == (420.0 if FILMS_ON_METAL else 0.0)


@pytest.mark.skipif(not FILMS_ON_METAL, reason="Glass has films from Blender 5.0 on")
def test_a_soap_bubble_is_there(material):
    """Glass of IOR 1, which lets all pass unbent, but for its film."""
    bubble = material.shade(material.add("ShaderNodeBsdfGlass", IOR=1.0, Thin_Film_Thickness=500.0))
    assert bubble.ior == pytest.approx(1.0, abs=1e-5) and bubble.ior != 1.0
    assert material.shade(material.add("ShaderNodeBsdfGlass", IOR=1.0)).ior == 1.0


@pytest.mark.skipif(not FILMS_ON_METAL, reason="Metallic has films from Blender 5.0 on")
def test_a_film_on_a_conductor_knows_its_index(material):
    b_node = material.add("ShaderNodeBsdfMetallic", Thin_Film_Thickness=80.0)
    b_node.fresnel_type = "PHYSICAL_CONDUCTOR"
    surface = material.shade(b_node)
    assert surface.metal_ior == pytest.approx(tuple(b_node.inputs["IOR"].default_value), rel=1e-5)


@pytest.mark.parametrize(
    ("kind", "name", "value", "stretch"),
    [
        ("ShaderNodeBsdfPrincipled", "Anisotropic", 0.5, 0.55**0.5),
        ("ShaderNodeBsdfPrincipled", "Anisotropic", 1.0, 0.1**0.5),
        ("ShaderNodeBsdfMetallic", "Anisotropy", 0.5, 0.55**0.5),
        ("ShaderNodeBsdfAnisotropic", "Anisotropy", 0.5, 2.0),
        ("ShaderNodeBsdfAnisotropic", "Anisotropy", -0.5, 0.5),
        ("ShaderNodeBsdfAnisotropic", "Anisotropy", 1.0, 100.0),
        ("ShaderNodeBsdfAnisotropic", "Anisotropy", 0.0, 1.0),
    ],
)
def test_anisotropy_stretches_as_cycles_has_it(material, kind, name, value, stretch):
    surface = material.shade(material.add(kind, **{name: value}))
    assert surface.stretch == pytest.approx(stretch, rel=1e-4)
    assert (surface.tangent is None) is (stretch == 1.0)
    assert list(material.warn) == []


def test_a_tangent_is_around_the_object_unless_one_is_given(material):
    surface = principled(material, Anisotropic=0.5)
    assert surface.tangent.inputs[0].data == "around:Z"
    b_node = material.add("ShaderNodeBsdfPrincipled", Anisotropic=0.5, Anisotropic_Rotation=0.25)
    material.link(material.add("ShaderNodeNewGeometry").outputs["Incoming"], b_node.inputs["Tangent"])
    surface = material.shade(b_node)
    assert surface.tangent.operation == "turned_about"
    assert surface.tangent.inputs[0].data == "incoming"


def bumped(material, *names):
    b_node = material.add("ShaderNodeBsdfPrincipled", Coat_Weight=0.5, Alpha=0.5)
    b_bump, b_noise = material.add("ShaderNodeBump"), material.add("ShaderNodeTexNoise")
    material.link(b_noise.outputs[0], b_bump.inputs["Height"])
    for name in names:
        material.link(b_bump.outputs[0], b_node.inputs[name])
    return material.shade(b_node)


@pytest.mark.parametrize("names", [(), ("Normal", "Coat Normal")])
def test_a_coat_on_the_same_normal_is_a_layer(material, names):
    assert bumped(material, *names).closures == ()


@pytest.mark.parametrize("name", ["Normal", "Coat Normal"])
def test_a_coat_with_a_normal_of_its_own_is_a_closure(material, name):
    """A bump below it leaves the coat smooth, as in EEVEE and Cycles."""
    body, coat = bumped(material, name).closures
    assert (body.weight, coat.weight) == (1.0, 0.5)
    assert not body.surface.coat_shows and body.surface.coat == coat.surface.coat == 0.5
    assert coat.surface.base_color == coat.surface.specular == BLACK
    assert isinstance(body.surface.normal, Expression) is (name == "Normal")
    assert isinstance(coat.surface.normal, Expression) is (name == "Coat Normal")


@pytest.mark.skipif(not THIN_WALL, reason="Blender has thin walls from 5.2 on")
def test_a_thin_walls_subsurface_lets_half_of_the_light_through(material):
    surface = principled(
        material, Thin_Wall=True, Subsurface_Weight=0.5, Subsurface_Anisotropy=0.2, Base_Color=(0.5, 1, 1, 1)
    )
    body, passes = surface.closures
    assert passes.surface.translucent and passes.weight == pytest.approx(0.3)
    assert body.surface.base_color == pytest.approx((0.35, 0.7, 0.7))
    assert list(material.warn) == []


def test_eevees_specular_is_a_sum(material):
    b_node = material.add("ShaderNodeEeveeSpecular", Transparency=0.25, Clear_Coat=1.0)
    b_node.inputs["Emissive Color"].default_value = (1, 2, 3, 1)
    weights = [closure.weight for closure in material.shade(b_node).closures]
    assert weights == pytest.approx([1.0, 0.75, 0.75, 0.1875, 0.25])
    assert list(material.warn) == []


@pytest.mark.parametrize("distribution", ["GGX", "MULTI_GGX"])
def test_light_that_facets_send_on_is_lost_where_eevee_loses_it(material, distribution):
    b_node = material.add("ShaderNodeBsdfAnisotropic")
    b_node.distribution = distribution
    assert material.shade(b_node).multiscatter is (distribution == "MULTI_GGX")
