# SPDX-License-Identifier: GPL-3.0-or-later
"""A survey tells mirrors that see off-screen things, glass behind glass and the like from what EEVEE can draw."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hybrid_addon.scene import Settings, World
from hybrid_addon.tracer.core.camera import generate_rays, project
from hybrid_addon.tracer.integrator.survey import KINDS, survey

SETTINGS = Settings(samples=16, max_depth=8, cutoff=1 / 255)
ROUGH = 0.75


@pytest.fixture
def found(build):
    """Run a survey of parts (mesh, surface), and give {kind: share} of one of them."""

    def look(*parts, of=0, blended=(), **other):
        other.setdefault("camera", build.camera((0, 0, 5), size=(64, 64)))
        settings = dataclasses.replace(SETTINGS, rough_samples=other.pop("rough_samples", 0))
        other.setdefault("world", World((0.5, 0.5, 0.5)))
        parts = [
            (mesh, surface if surface.roughness == ROUGH else dataclasses.replace(surface, roughness=0.0))
            for mesh, surface in parts
        ]
        result = survey(build.scene(*parts, **other), settings, frozenset(blended))
        shares = {kind: float(result.shares[i, of]) for i, kind in enumerate(KINDS)}
        return {kind: share for kind, share in shares.items() if share > 1e-3}, result

    return look


def facing(build, z, half=1.0):
    return build.quad([(-half, -half, z), (half, -half, z), (half, half, z), (-half, half, z)])


def test_a_matte_thing_and_a_mirror_of_the_sky_need_nothing(build, found):
    assert found((facing(build, 0), build.matte()))[0] == {}
    assert found((facing(build, 0), build.mirror()))[0] == {}


def test_a_mirror_needs_rays_for_what_is_behind_the_camera_and_only_for_that(build, found):
    behind = facing(build, 20, 100.0)
    shares, result = found((facing(build, 0), build.mirror()), (behind, build.matte()))
    assert shares == {"OFF_SCREEN": pytest.approx(1)}
    assert result.needs[0] == pytest.approx(1) and result.needs[1] == 0
    assert found((facing(build, 0), build.mirror(0.25)), (behind, build.matte()))[0]["OFF_SCREEN"] == pytest.approx(
        0.25
    )


def test_a_floor_that_mirrors_what_the_picture_shows_needs_nothing(build, found):
    """The wall is seen and mirrored; rays that pass over it meet the sky."""
    floor = build.quad([(-2, 0, 2), (2, 0, 2), (2, 0, -2), (-2, 0, -2)])
    wall = build.quad([(-2, 0, -2), (2, 0, -2), (2, 3, -2), (-2, 3, -2)])
    camera = build.camera((0, 2, 8), (0, 1, 0), size=(96, 96))
    assert found((floor, build.mirror()), (wall, build.matte()), camera=camera)[0].get("OFF_SCREEN", 0) < 0.03
    aside = build.camera((0, 2, 8), (0, -3.2, 0), size=(96, 96))  # the wall leaves the picture
    assert found((floor, build.mirror()), (wall, build.matte()), camera=aside)[0]["OFF_SCREEN"] > 0.2


def test_glass_refracts_twice_a_sheet_once(build, found):
    assert found((build.box(), build.glass()))[0]["REFRACTED"] > 0.9
    assert "REFRACTED" not in found((facing(build, 0), build.glass()), (facing(build, -3, 50), build.matte()))[0]


def test_glass_behind_glass_but_not_paper_behind_glass(build, found):
    sheet, back = facing(build, 0), facing(build, -3, 50)
    assert found((sheet, build.glass()), (back, build.glass()))[0]["BEHIND"] > 0.9
    assert found((sheet, build.glass()), (back, build.matte()))[0] == {}


def test_mirrors_miss_glass_and_blended_things_and_other_mirrors(build, found):
    mirror, behind = (facing(build, 0), build.mirror()), facing(build, 20, 100.0)
    assert "UNSEEN" in found(mirror, (behind, build.glass()))[0]
    veil = build.matte(opacity=0.5, ior=1.0)
    veil = dataclasses.replace(veil, name="veil")
    assert found(mirror, (behind, veil), blended=["veil"])[0]["UNSEEN"] == pytest.approx(1)
    assert "UNSEEN" not in found(mirror, (behind, veil))[0]
    assert "MIRRORS" in found(mirror, (behind, build.mirror(0.9)))[0]


def test_rough_mirrors_need_rays_where_rays_follow_them(build, found):
    """Else the survey says what they would need."""
    brushed = build.mirror(roughness=ROUGH, layered=True)
    parts = (facing(build, 0), brushed), (facing(build, 20, 100.0), build.matte())
    shares, result = found(*parts)
    assert shares == {} and result.needs[0] == 0 and result.if_rough[0] > 0.5
    followed, result = found(*parts, rough_samples=4)
    assert followed["OFF_SCREEN"] > 0.5 and result.needs[0] == result.if_rough[0]
    # The picture's rays: four from each place, and that from the camera.
    assert result.rays[0] == pytest.approx(5 * result.pixels[0], rel=0.1)


def test_coverage_and_rays_are_counted_exactly(build, found):
    """A quad over a quarter of the picture's sides: 1/16 of it; a mirror under the sky sends one ray on."""
    shape = facing(build, 0, 5 * 0.5 / 4)
    _, result = found((shape, build.mirror()))
    assert result.pixels[0] == result.all_pixels / 16
    assert result.rays[0] == 2 * result.pixels[0]
    assert result.seconds_per_ray > 0


def test_projection_is_the_inverse_of_the_camera(build):
    rng = np.random.default_rng(1)
    for other in ({}, {"projection": "ORTHO", "view_plane": (-3, 4, -2, 2.5)}):
        camera = build.camera((1, -4, 2), (0.2, 0, 0.1), (0, 0, 1), size=(40, 30), **other)
        x, y = rng.uniform(0, 40, 50), rng.uniform(0, 30, 50)
        origin, direction, _ = generate_rays(camera, x, y, np.zeros(3), 10.0)
        back = project(camera, origin + 3.0 * direction.astype(float))
        np.testing.assert_allclose(back[:2], [x, y], atol=1e-3)


def test_the_back_of_a_thing_is_not_what_the_picture_shows(build, found):
    """A mirror behind a box shows its back, at a place of the picture where its front is."""
    mirror = facing(build, -4, 50.0)
    camera = build.camera((3, 0, 8), size=(64, 64))
    shares, _ = found((mirror, build.mirror()), (build.box(), build.matte()), camera=camera)
    assert shares["OFF_SCREEN"] > 0.005


def test_what_lies_behind_a_veil_is_seen_as_without_it(build, found):
    """Going straight through is no refraction."""
    veil = build.matte(opacity=0.5, ior=1.0)
    back = facing(build, -3, 50), build.matte()
    assert found((facing(build, 1), veil), (facing(build, 0, 3.0), build.glass()), back)[0] == {}


@pytest.mark.parametrize("opacity", [0.0, 0.25])
def test_light_that_goes_straight_through_a_veil_is_that_of_what_lies_behind(build, found, opacity):
    """A mirror of what the picture does not show, behind a larger veil: it needs rays, the veil does not."""
    veil = (facing(build, 1, 3.0), build.matte(opacity=opacity, ior=1.0))
    mirror, behind = (facing(build, 0), build.mirror()), (facing(build, 20, 100.0), build.matte())
    shares, result = found(mirror, veil, behind)
    _, without = found(mirror, behind)
    assert list(shares) == ["OFF_SCREEN"] and shares["OFF_SCREEN"] >= 1 - opacity  # the mirror shows the veil's back
    assert result.needs[1] == 0 and result.pixels[1] == pytest.approx(opacity * result.all_pixels)
    assert result.pixels[0] == pytest.approx((1 - opacity) * without.pixels[0])
    # To ray trace the veil is to ray trace what shows through it.
    assert result.rays[1] > result.rays[0] >= without.rays[0]


def test_shares_are_shares_where_a_tint_brightens(build, found):
    """Light that a glass multiplies by three, twice: all of it counts, and no more than all."""
    glass = build.glass(transmission_tint=(3.0, 3.0, 3.0))
    shares, result = found((build.box(), glass))
    assert 0.9 < shares["REFRACTED"] <= 1 and 0.9 < result.needs[0] <= 1
