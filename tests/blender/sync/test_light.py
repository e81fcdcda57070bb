# SPDX-License-Identifier: GPL-3.0-or-later
"""Watts to radiometric units, by the formulas that EEVEE and Blender document."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from hybrid_addon.blender.sync import Warnings
from hybrid_addon.blender.sync.light import LightContext, translate_light
from hybrid_addon.scene import AreaLight, PointLight, SpotLight, SunLight

pytestmark = pytest.mark.blender
PI = math.pi


def light(kind, matrix=None, falloff="PHYSICAL", threshold=0.01, warn=None, **settings):
    b_light = bpy.data.lights.new("Lamp", kind)
    b_light.energy = 10.0
    for name, value in settings.items():
        setattr(b_light, name, value)
    b_object = bpy.data.objects.new("Lamp", b_light)
    matrix_world = np.array(matrix or Matrix.Identity(4), dtype=np.float64)
    return translate_light(b_object, matrix_world, LightContext(falloff, threshold), warn or Warnings())


def test_a_point_lights_intensity_is_its_power_over_4_pi(scene):
    lamp = light("POINT", Matrix.Translation((1, 2, 3)), color=(1, 0.5, 0.25), shadow_soft_size=0.2)
    assert type(lamp) is PointLight
    assert lamp.position == (1, 2, 3)
    assert lamp.intensity == pytest.approx(np.array((1, 0.5, 0.25)) * 10 / (4 * PI))
    assert lamp.radius == pytest.approx(0.2)
    assert lamp.range == math.inf


def test_exposure_doubles_per_stop(scene):
    assert light("POINT", exposure=3.0).intensity[0] == pytest.approx(8 * 10 / (4 * PI))


def test_temperature_tints_by_blenders_black_body(scene):
    lamp = light("SUN", energy=1.0, color=(0.5, 1, 1), use_temperature=True, temperature=3000.0)
    assert lamp.irradiance == pytest.approx((0.5 * 1.7708, 0.84428, 0.27222), rel=1e-3)


@pytest.mark.parametrize(
    ("kind", "settings", "area"),
    [
        ("POINT", {"shadow_soft_size": 0.5}, 4 * PI * 0.25),
        ("POINT", {"shadow_soft_size": 0.0}, 4.0),
        ("SUN", {"angle": 0.4}, PI * math.sin(0.2) ** 2),
        ("SUN", {"angle": 0.0}, 1.0),
        ("AREA", {"shape": "SQUARE", "size": 2.0}, 4.0),
        ("AREA", {"shape": "ELLIPSE", "size": 2.0, "size_y": 3.0}, 6.0 * PI / 4),
    ],
)
def test_without_normalize_power_is_per_area(scene, kind, settings, area):
    def strength(lamp):
        return {"POINT": "intensity", "SUN": "irradiance", "AREA": "radiance"}[kind], lamp

    name, normalised = strength(light(kind, **settings))
    _, raw = strength(light(kind, normalize=False, **settings))
    assert getattr(raw, name)[0] / getattr(normalised, name)[0] == pytest.approx(area, rel=1e-6)


def test_a_suns_energy_is_its_irradiance_and_it_shines_along_minus_z(scene):
    lamp = light("SUN", Matrix.Rotation(PI / 2, 4, "X") @ Matrix.Scale(3, 4), energy=2.5, angle=0.1)
    assert type(lamp) is SunLight
    assert lamp.irradiance == pytest.approx((2.5, 2.5, 2.5))
    assert lamp.direction == pytest.approx((0, -1, 0), abs=1e-7)
    assert lamp.angle == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("settings", "half_v", "area", "shape"),
    [
        ({"shape": "SQUARE", "size": 1.0}, 1.5, 2 * 3, "RECTANGLE"),
        ({"shape": "RECTANGLE", "size": 1.0, "size_y": 4.0}, 6.0, 2 * 12, "RECTANGLE"),
        ({"shape": "DISK", "size": 1.0}, 1.5, 2 * 3 * PI / 4, "ELLIPSE"),
        ({"shape": "ELLIPSE", "size": 1.0, "size_y": 4.0}, 6.0, 2 * 12 * PI / 4, "ELLIPSE"),
    ],
)
def test_an_area_lights_radiance_is_power_over_pi_and_area(scene, settings, half_v, area, shape):
    lamp = light("AREA", Matrix.Diagonal((2, 3, 7, 1)), **settings)
    assert type(lamp) is AreaLight
    assert lamp.radiance[0] == pytest.approx(10 / (PI * area))
    assert lamp.axis_u == pytest.approx((1, 0, 0))
    assert lamp.axis_v == pytest.approx((0, half_v, 0))
    assert lamp.direction == pytest.approx((0, 0, -1))
    assert lamp.shape == shape


@pytest.mark.parametrize(("side", "half"), [(2.0, 1.0), (0.008, 0.004), (0.004, 0.003), (0.001, 0.003)])
def test_no_side_of_an_area_light_is_shorter_than_eevees(scene, side, half):
    """EEVEE makes half sides 3 mm at least (its light.cc), and the light as strong as that area asks."""
    lamp = light("AREA", shape="RECTANGLE", size=side, size_y=2.0)
    assert lamp.axis_u == pytest.approx((half, 0, 0), abs=1e-7) and lamp.axis_v == pytest.approx((0, 1, 0))
    assert lamp.radiance[0] == pytest.approx(10 / (PI * 4 * half), rel=1e-5)


def test_an_area_light_without_area_is_left_out_by_name(scene):
    warn = Warnings()
    assert light("AREA", Matrix.Diagonal((1, 0, 1, 1)), warn=warn) is None
    assert next(iter(warn)).startswith("light 'Lamp' has no area")


@pytest.mark.parametrize(
    ("kind", "matrix"),
    [("SUN", Matrix.Diagonal((1, 1, 0, 1))), ("POINT", Matrix.Translation((float("nan"), 0, 0)))],
)
def test_a_light_that_is_nowhere_is_left_out_by_name(scene, kind, matrix):
    warn = Warnings()
    assert light(kind, matrix, warn=warn) is None
    assert next(iter(warn)).startswith("light 'Lamp' is nowhere")


def test_a_spots_cone_is_stretched_by_its_scale(scene):
    lamp = light("SPOT", Matrix.Diagonal((2, 1, 1, 1)), spot_size=PI / 2, spot_blend=0.3)
    assert type(lamp) is SpotLight
    assert lamp.intensity[0] == pytest.approx(10 / (4 * PI))  # the cone does not gather light
    assert lamp.cos_cone == pytest.approx(math.cos(PI / 4))
    assert lamp.blend == pytest.approx(0.3)
    for offset in ((2, 0, -1), (0, 1, -1)):  # both on the rim of a cone with tangent 1
        x, y, z = lamp.world_to_light @ offset
        assert math.hypot(x, y) / -z == pytest.approx(1.0)


def test_range_is_where_the_power_falls_below_the_threshold(scene):
    assert light("POINT", falloff="EEVEE").range == pytest.approx(math.sqrt(10 / 100 / 0.01))
    lamp = light(
        "POINT", falloff="EEVEE", color=(0.1, 0.4, 0.2), diffuse_factor=0.5, specular_factor=0.25, exposure=1.0
    )
    assert lamp.range == pytest.approx(math.sqrt(0.5 * 0.4 * 20 / 100 / 0.01))
    assert light("AREA", falloff="EEVEE", threshold=0.0).range < math.inf
    custom = light("SPOT", falloff="EEVEE", use_custom_distance=True, cutoff_distance=7.5)
    assert custom.range == 7.5
    assert light("SPOT", falloff="PHYSICAL", use_custom_distance=True, cutoff_distance=7.5).range == math.inf


def test_lobe_factors_shadow_and_falloff_switches(scene):
    lamp = light("POINT", diffuse_factor=0.25, specular_factor=0.5, use_shadow=False, use_soft_falloff=False)
    assert (lamp.diffuse, lamp.specular, lamp.cast_shadow, lamp.soft_falloff) == (0.25, 0.5, False, False)
    b_object = bpy.data.objects["Light"]
    b_object.visible_diffuse = False
    context = LightContext("EEVEE", 0.01)
    assert translate_light(b_object, np.eye(4), context, Warnings()).diffuse == 0.0
