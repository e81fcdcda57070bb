# SPDX-License-Identifier: GPL-3.0-or-later
"""Layered surfaces: energy, limits in closed form, and what expressions give at hits."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon import expressions as ex
from hybrid_addon.scene import Expression, Settings, SunLight, Surface, Texture, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.emitters.prefilter import blurred
from hybrid_addon.tracer.materials.columns import ROWS
from hybrid_addon.tracer.materials.fields import fields_of
from hybrid_addon.tracer.materials.principled import (
    albedos,
    grazing_reflectance,
    layered_columns,
    metal_reflectance,
    normal_reflectance,
    reflectance,
)

WHITE_WORLD = World((1.0, 1.0, 1.0))
WHITE = {"base_color": (1.0, 1.0, 1.0), "layered": True}
GLOSS = {"specular": (0.04, 0.04, 0.04)}


def seen(build, surface, world=WHITE_WORLD, **other):
    cam = build.camera(size=(24, 24), half=0.15)
    s = build.scene((build.icosphere(3, 1.0, True), surface), camera=cam, world=world, **other)
    return trace(s, replace(build.one_ray, max_depth=16)).radiance


@pytest.mark.parametrize(
    "surface",
    [
        Surface(**WHITE, **GLOSS, roughness=0.5),
        Surface(**WHITE, **GLOSS, roughness=0.0),
        Surface(**WHITE, coat=1.0, coat_roughness=0.4, roughness=0.5),
        Surface(layered=True, reflectivity=1.0, roughness=0.4),
        Surface(**WHITE, **GLOSS, opacity=0.4, ior=1.0),
        Surface(**WHITE, sheen=1.0),
    ],
)
def test_a_lossless_surface_vanishes_in_a_white_world(build, surface):
    assert np.abs(seen(build, surface) - 1).max() < 2e-5


def test_a_smooth_lobes_albedo_is_schlicks():
    cos = np.linspace(0.1, 1, 19)
    sums = albedos(cos, np.zeros(19))
    f0 = np.full((1, 19), 0.04)
    assert reflectance(f0, 1.0, sums)[0] == pytest.approx(0.04 + 0.96 * (1 - cos) ** 5, abs=4e-3)
    assert metal_reflectance(f0 + 0.5, np.ones((1, 19)), sums) == pytest.approx(reflectance(f0 + 0.5, 1.0, sums))


def test_multiple_scattering_keeps_all_light_of_a_white_metal():
    roughness = np.linspace(0, 1, 21)
    one = np.ones((1, 21))
    assert reflectance(one, one, albedos(np.full(21, 0.5), roughness)) == pytest.approx(one, abs=1e-6)


def test_the_edge_tint_holds_at_82_degrees():
    cos, edge = np.full(1, 1 / 7), np.full((1, 1), 0.25)
    sums = albedos(cos, np.zeros(1))
    plain = metal_reflectance(np.full((1, 1), 0.5), np.ones((1, 1)), sums)
    assert metal_reflectance(np.full((1, 1), 0.5), edge, sums) == pytest.approx(0.25 * plain, rel=0.03)


def test_a_blurred_environment_keeps_its_mean_and_a_uniform_one_itself():
    rng = np.random.default_rng(0)
    pixels = np.ones((32, 64, 4), np.float32)

    def rows(band):
        return pixels[band, :, :3]

    assert all(np.abs(image - 1).max() < 1e-6 for image in blurred(rows, (32, 64)).values())
    pixels[..., :3] = rng.random((32, 64, 3))

    def mean(image):
        rows, columns = image.shape[:2]
        area = np.diff(np.sin(np.linspace(-np.pi / 2, np.pi / 2, rows + 1))) / 2 / columns
        return (image[..., :3] * area[:, None, None]).sum((0, 1))

    for image in blurred(rows, (32, 64)).values():
        assert mean(image) == pytest.approx(mean(pixels), rel=0.01)


def test_a_dark_coat_takes_from_what_is_below(build):
    bare = seen(build, Surface(layered=True, base_color=(0.5, 0.5, 0.5)))[12, 12]
    coated = seen(build, Surface(layered=True, base_color=(0.5, 0.5, 0.5), coat=1.0, coat_roughness=0.5))[12, 12]
    assert coated == pytest.approx(0.5 * (1 - 0.04) + 0.04, abs=3e-3)
    assert bare == pytest.approx(0.5)


def test_rough_panes_lose_the_light_that_is_lost_between_microfacets():
    """Where that is not given back, a face reflects its single scattering alone."""
    cos = np.array([0.3, 0.8])
    fields = {"layered": True, "opacity": 0.0, "thin": True, "ior": 1.5, "roughness": 1.0}
    found = [layered_columns(fields_of(Surface(multiscatter=m, **fields)), cos)[ROWS["lobe"]][0] for m in (True, False)]
    sums, f0 = albedos(cos, np.ones(1)), normal_reflectance(np.float64(1.5))
    once = f0 * sums[0] + grazing_reflectance(f0) * sums[1]
    assert found[1] == pytest.approx(once * (1 + (1 - once) ** 2 / (1 - once**2)), rel=1e-5)
    assert (found[0] > found[1] * 1.01).all()


def test_a_thin_pane_reflects_and_passes_all_light(build):
    pane = Surface(layered=True, opacity=0.0, thin=True, ior=1.5)
    assert np.abs(seen(build, pane) - 1).max() < 1e-4
    lit = seen(build, pane, World(), lights=(SunLight("s", (0, 0, 1), (1, 1, 1)),))
    assert np.isfinite(lit).all()


# ------------------------------------------------------------------------------------------------ expressions


def test_a_constant_expression_changes_no_bit(build):
    """Worked out at each hit as a constant is worked out once."""
    constant = Surface(base_color=(0.5, 0.25, 0.125), reflectivity=0.25, opacity=0.5, specular=(0.25, 0.25, 0.25))
    zero = ex.apply("multiply", Expression("attribute", (), "cosine"), 0.0)
    varying = replace(
        constant,
        base_color=ex.apply("add", (0.5, 0.25, 0.125), zero),
        reflectivity=ex.apply("add", 0.25, zero),
        opacity=ex.apply("add", 0.5, zero),
    )
    lights = (SunLight("s", (0.3, 0, 1), (3, 3, 3)),)
    assert np.array_equal(seen(build, constant, lights=lights), seen(build, varying, lights=lights))


def test_attributes_and_textures_meet_at_hits(build):
    """A colour of the corners times an image, on a quadrilateral seen from above."""
    pixels = np.full((2, 2, 4), 0.5, np.float32)
    color = np.array([(0, 0, 0, 1), (1, 0, 0, 1), (1, 1, 0, 1), (0, 1, 0, 1)], np.float32)
    quad = build.quad(
        [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)],
        uv_maps={"": np.zeros((4, 2), np.float32)},
        attributes={"color:Col": color},
    )
    base = ex.apply(
        "multiply",
        Expression("image", (), Texture("half", pixels)),
        ex.apply("first_three", Expression("attribute", (), "color:Col")),
    )
    cam = build.camera(eye=(0, 0, 2), size=(16, 16), half=0.25)
    surface = Surface(base_color=base, ambient=1.0)
    film = trace(build.scene((quad, surface), camera=cam, world=WHITE_WORLD), Settings(samples=1, camera_sees="ALL"))
    x = ((np.arange(16) + 0.5) / 16 - 0.5) * 1.0  # metres on the quadrilateral
    assert film.radiance[8, :, 0] == pytest.approx(0.5 * (x + 1) / 2, abs=1e-5)
    assert film.radiance[:, 8, 1] == pytest.approx(0.5 * (x + 1) / 2, abs=1e-5)
    assert not film.radiance[..., 2].any()


def test_a_shadow_passes_where_the_texture_is_clear(build):
    """Alpha from the corners: 1 on one side, 0 on the other."""
    color = np.array([(0, 0, 0, 1), (1, 1, 1, 1), (1, 1, 1, 1), (0, 0, 0, 1)], np.float32)
    sheet = build.quad([(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)], "sheet", attributes={"color:Col": color})
    alpha = ex.apply("greater", ex.apply("channel", Expression("attribute", (), "color:Col"), data=0), 0.5)
    cut = Surface(base_color=(0, 0, 0), opacity=alpha, ior=1.0)
    floor = build.quad([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], "floor")
    lights = (SunLight("s", (0, 0, 1), (np.pi,) * 3),)
    cam = build.camera(eye=(0, 0, 4), size=(16, 16), half=0.2)
    film = trace(build.scene((floor, build.matte((1, 1, 1))), (sheet, cut), camera=cam, lights=lights), build.one_ray)
    assert film.radiance[8, 3, 0] == pytest.approx(1, abs=1e-5)
    assert film.radiance[8, 12, 0] == 0


@pytest.mark.parametrize(("strength", "expected"), [(0.0, 0.0), (1.0, 0.25)])
def test_a_bump_tilts_the_normal_by_the_slope(build, strength, expected):
    """Height = x / 4: the normal leans against x by atan(1 / 4)."""
    height = ex.apply("multiply", ex.apply("channel", Expression("attribute", (), "position"), data=0), 0.25)
    normal = ex.apply("bump", Expression("slope", (height,)), strength, 1.0, Expression("attribute", (), "normal"))
    quad = build.quad([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    light = SunLight("s", (1, 0, 1), (np.pi * np.sqrt(2),) * 3)
    s = build.scene((quad, Surface(base_color=(1, 1, 1), normal=normal)), lights=(light,))
    lit = trace(s, build.one_ray).radiance[8, 8, 0]
    assert lit == pytest.approx((1 - expected) / np.sqrt(1 + expected**2), rel=1e-3)
