# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from hybrid_addon.scene import AreaLight, PointLight, SpotLight, SunLight
from hybrid_addon.tracer.emitters.form_factors import form_factor
from hybrid_addon.tracer.emitters.lights import compile_lights


def light_up(light, points, normals, least=0.0, center=(0, 0, 0)):
    compiled = compile_lights([light], np.array(center, float), np.zeros(0, np.intp))[0]
    points = (np.array(points, float) - center).T.astype(np.float32)
    normals = np.array(normals, np.float32).reshape(-1, 3).T
    normals = np.broadcast_to(normals, points.shape)
    return compiled.illuminate(points, normals, np.full(points.shape[1], least, np.float32))


UP = (0, 0, 1)


def test_point_light_falls_off_with_the_square_of_the_distance():
    lit = light_up(PointLight("p", (0, 0, 0), (1, 1, 1)), [(0, 0, -1), (0, 0, -2), (0, 0, -10)], UP)
    np.testing.assert_allclose(lit.diffuse, [1, 0.25, 0.01], rtol=1e-6)


def test_point_light_goes_with_the_cosine_and_not_behind():
    lit = light_up(PointLight("p", (0, 0, 1), (1, 1, 1)), [(0, 0, 0), (1, 0, 0), (0, 0, 2)], UP)
    np.testing.assert_allclose(lit.diffuse, [1, 0.5 * 0.5**0.5, 0], rtol=1e-6)


@pytest.mark.parametrize(("distance", "radius", "expected"), [(1, 0.1, 0.990099), (1, 0.2, 0.961538), (2, 1.0, 0.8)])
def test_soft_falloff_is_a_disk_that_faces_the_point(distance, radius, expected):
    lit = light_up(PointLight("p", (0, 0, distance), (1, 1, 1), radius=radius), [(0, 0, 0)], UP)
    assert lit.diffuse[0] * distance**2 == pytest.approx(expected, rel=1e-5)


def test_without_soft_falloff_the_radius_matters_only_inside():
    light = PointLight("p", (0, 0, 0), (1, 1, 1), radius=0.5, soft_falloff=False)
    lit = light_up(light, [(0, 0, -1), (0, 0, -0.25), (0, 0, 0)], UP, least=1e-6)
    np.testing.assert_allclose(lit.diffuse[:2], [1, 4], rtol=1e-6)
    assert np.isfinite(lit.diffuse).all()


def test_a_light_at_the_shaded_point_is_finite():
    lit = light_up(PointLight("p", (0, 0, 0), (1, 1, 1)), [(0, 0, 0)], UP, least=1e-6)
    assert np.isfinite(lit.diffuse).all() and np.isfinite(lit.wi).all()


def test_range_window_is_eevees():
    # A 10 W point light ends at 3.16 m and is at 70.6 % at 2 m.
    light = PointLight("p", (0, 0, 0), (1, 1, 1), range=10**0.5)
    lit = light_up(light, [(0, 0, -2), (0, 0, -3.17), (0, 0, -100)], UP)
    np.testing.assert_allclose(lit.diffuse, [0.7056 / 4, 0, 0], rtol=1e-4)


def test_spot_blends_by_a_smoothstep():
    cos_cone, blend = np.cos(0.5), 0.4
    spot = SpotLight("s", (0, 0, 5), (1, 1, 1), cos_cone=cos_cone, blend=blend)
    rim = (1 - cos_cone) * blend
    cosines = np.array([1, cos_cone + rim, cos_cone + rim / 2, cos_cone + rim / 4, cos_cone - 1e-3])
    points = np.stack([5 * np.tan(np.arccos(cosines)), np.zeros(5), np.zeros(5)], 1)
    lit = light_up(spot, points, UP)
    falloff = cosines**3 / 25
    np.testing.assert_allclose(lit.diffuse / falloff, [1, 1, 0.5, 0.15625, 0], atol=2e-5)


def test_spot_without_blend_is_hard_and_does_not_shine_backwards():
    spot = SpotLight("s", (0, 0, 0), (1, 1, 1), cos_cone=np.cos(0.5), blend=0.0)
    t = np.tan([0.499, 0.501])
    lit = light_up(spot, [(t[0], 0, -1), (t[1], 0, -1)], UP)
    assert lit.diffuse[0] > 0 and lit.diffuse[1] == 0
    assert light_up(spot, [(0, 0, 1)], (0, 0, -1)).diffuse[0] == 0


def test_sun_goes_with_the_cosine():
    sun = SunLight("sun", (0, 3, 4), (2, 2, 2))
    lit = light_up(sun, [(9, 9, 9)] * 3, [(0, 0, 1), (0, 0.6, 0.8), (0, 0, -1)])
    np.testing.assert_allclose(lit.diffuse, [0.8, 1, 0], rtol=1e-6)


def numeric_form_factor(point, normal, center, u, v, steps=400):
    """Irradiance over pi radiance by brute force."""
    s = (np.arange(steps) + 0.5) / steps * 2 - 1
    a, b = (g.ravel() for g in np.meshgrid(s, s))
    d = center + a[:, None] * u + b[:, None] * v - point
    r2 = (d * d).sum(1)
    light_normal = np.cross(u, v)
    area = 4 * np.linalg.norm(light_normal)
    cos_l = np.abs(d @ light_normal) / np.linalg.norm(light_normal) / np.sqrt(r2)
    cos_s = np.maximum(d @ normal, 0) / np.sqrt(r2)
    return (cos_l * cos_s / r2).mean() * area / np.pi


@pytest.mark.parametrize(
    ("point", "normal"),
    [((0, 0, 0), (0, 0, 1)), ((0.3, -2, 0), (0, 0.6, 0.8)), ((0, 0, 0), (0.8, 0, 0.6)), ((0, 0, 0.5), (1, 0, 0)),
     ((2, 1, 0), (0, 0, 1)), ((0.1, 0.2, 0), (0.99, 0, -0.14))],
)  # fmt: skip
def test_area_light_is_lamberts_form_factor_with_the_horizon(point, normal):
    u, v, center = np.array([1.0, 0.2, 0]), np.array([0, 0.7, 0]), np.array([0.2, 0.1, 1.0])
    normal = np.array(normal) / np.linalg.norm(normal)
    point = np.array(point, float)
    light = AreaLight("a", tuple(center), (0, 0, -1), tuple(u), tuple(v), (1, 1, 1))
    lit = light_up(light, [point], normal)
    expected = np.pi * numeric_form_factor(point, normal, center, u, v)
    assert lit.diffuse[0] == pytest.approx(expected, rel=2e-4, abs=1e-5)


def test_form_factor_of_a_whole_half_space_is_one():
    corners = [np.float32([[x], [y], [1e-3]]) for x, y in ((-1e3, -1e3), (1e3, -1e3), (1e3, 1e3), (-1e3, 1e3))]
    assert form_factor(corners, np.float32([[0], [0], [1]]))[0] == pytest.approx(1, abs=1e-4)


def test_area_light_shines_one_way_only():
    light = AreaLight("a", (0, 0, 0), (0, 0, -1), (1, 0, 0), (0, 1, 0), (1, 1, 1))
    assert light_up(light, [(0, 0, -1)], UP).diffuse[0] > 0
    behind = light_up(light, [(0, 0, 1)], (0, 0, -1))
    assert behind.diffuse[0] == 0 and behind.specular[0] == 0


def test_far_area_light_is_a_point_light_without_a_seam():
    light = AreaLight("a", (0, 0, 0), (0, 0, -1), (1, 0, 0), (0, 1, 0), (1, 1, 1))
    limit = 64 * 2**0.5
    lit = light_up(light, [(0, 0, -limit * 0.999), (0, 0, -limit * 1.001)], UP)
    np.testing.assert_allclose(lit.diffuse * np.array([0.999, 1.001]) ** 2 * limit**2, 4, rtol=3e-4)


def test_ellipse_has_the_area_of_an_ellipse():
    light = AreaLight("a", (0, 0, 0), (0, 0, -1), (1, 0, 0), (0, 0.5, 0), (1, 1, 1), shape="ELLIPSE")
    lit = light_up(light, [(0, 0, -300)], UP)
    assert lit.diffuse[0] * 300**2 == pytest.approx(np.pi * 0.5, rel=1e-4)


def test_lights_are_placed_relative_to_the_centre():
    light = PointLight("p", (1e6, 0, 1), (1, 1, 1))
    assert light_up(light, [(1e6, 0, 0)], UP, center=(1e6, 0, 0)).diffuse[0] == 1
