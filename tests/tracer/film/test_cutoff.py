# SPDX-License-Identifier: GPL-3.0-or-later
"""The cutoff: what it may cut, that it says what it cut, and that it saves rays."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.measure.stability import effects
from hybrid_addon.measure.stability.build import shoot
from hybrid_addon.scene import PointLight, Settings, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.core.constants import BUDGET_UNIT, FAINT_LIGHT, LIGHT_BUDGET
from hybrid_addon.tracer.film.samples import SampleBuffer
from hybrid_addon.tracer.integrator import whitted
from tests.tracer.unpruned import without

ALL = Settings(samples=4, camera_sees="ALL", threads=1, max_depth=9)
CUTOFF = 1 / 255


def lathe(build, profile, segments=48, name="lathe"):
    """A closed body of revolution about z: profile (radius, z) from axis to axis, its inside on the left."""
    profile = np.array(profile, float)
    angle = np.arange(segments) * 2 * np.pi / segments
    r, z = profile[:, 0], profile[:, 1]
    rings = np.stack([np.outer(r, np.cos(angle)), np.outer(r, np.sin(angle)), np.outer(z, np.ones(segments))], -1)
    i, j = np.meshgrid(np.arange(len(profile) - 1), np.arange(segments), indexing="ij")
    a, b = i * segments + j, i * segments + (j + 1) % segments
    triangles = np.concatenate(
        [np.stack(t, -1).reshape(-1, 3) for t in ((a, b, b + segments), (a, b + segments, a + segments))]
    )
    return build.mesh(rings.reshape(-1, 3), triangles, name)


@pytest.fixture(scope="module")
def wine_glass(build):
    """A thin goblet of glass before a checkered wall, under a lamp and a white sky."""
    outer = [(0, 0), (0.35, 0), (0.35, 0.02), (0.04, 0.06), (0.04, 0.5), (0.3, 0.65), (0.36, 0.9), (0.3, 1.3)]
    inner = [(0.285, 1.3), (0.345, 0.9), (0.285, 0.66), (0, 0.56)]
    wall = build.quad([(-4, 2, -1), (4, 2, -1), (4, 2, 4), (-4, 2, 4)])
    return build.scene(
        (lathe(build, outer + inner), build.glass(1.5)),
        (wall, build.emitter(0.9, 0.5, 0.1)),
        (build.quad([(-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0)]), build.matte()),
        lights=(PointLight("p", (1, -2, 4), (20, 20, 20)),),
        world=World((1, 1, 1)),
        camera=build.camera((0, -3, 1.2), (0, 0, 0.65), (0, 0, 1), (24, 24), 0.3),
    )


@pytest.fixture(scope="module")
def deep(wine_glass):
    return trace(wine_glass, ALL)


def test_the_error_is_within_the_residual_in_every_pixel(wine_glass, deep):
    film = trace(wine_glass, replace(ALL, cutoff=CUTOFF))
    brightest = 3.0  # of world, wall, and the lamp on the floor: 20 / 4^2 * 0.8 / pi + 0.8 < 1.2
    error = np.abs(film.radiance.astype(float) - deep.radiance).max(2)
    assert (error <= (film.residual.astype(float) + deep.residual) * brightest + 1e-6).all()
    assert 0 < film.residual.max() <= CUTOFF + deep.residual.max()
    assert sum(film.rays[k] for k in ("reflected", "refracted")) < 0.5 * sum(
        deep.rays[k] for k in ("reflected", "refracted")
    )
    cut = [e for e in film.skipped if "cutoff" in str(e["why"])]
    assert {e["what"] for e in cut} >= {"rays"} and all(e["count"] > 0 for e in cut)


def test_a_deep_tree_with_a_cutoff_costs_less_than_a_shallow_one_without(wine_glass, deep):
    # Were the budget spent at once, tiny branches would multiply unchecked: 2^depth rays.
    film = trace(wine_glass, replace(ALL, max_depth=40, cutoff=CUTOFF))
    assert sum(film.rays.values()) < sum(deep.rays.values())
    assert film.residual.mean() < deep.residual.mean()


@pytest.mark.parametrize("cutoff", [1e-4, CUTOFF, 0.1])
def test_white_furnace_with_a_cutoff(build, cutoff):
    s = build.scene((build.icosphere(2, 1, smooth=True), build.glass(1.5)), world=World((1, 1, 1)))
    film = trace(s, replace(ALL, cutoff=cutoff))
    np.testing.assert_allclose(film.radiance + film.residual[..., None], 1, atol=1e-6)


@pytest.mark.parametrize("cutoff", [1e-3, 0.1])
@pytest.mark.parametrize(("threads", "chunk"), [(1, 64), (2, 1 << 12), (2, 1000)])
def test_threads_and_chunks_cut_the_same_rays_exact(wine_glass, cutoff, threads, chunk):
    settings = replace(ALL, cutoff=cutoff)
    s = replace(wine_glass, camera=replace(wine_glass.camera, window=(6, 3, 18, 21)))
    one = trace(s, settings)
    other = trace(s, replace(settings, threads=threads, chunk=chunk))
    np.testing.assert_array_equal(one.radiance, other.radiance)
    np.testing.assert_array_equal(one.residual, other.residual)


def test_no_cutoff_cuts_nothing(wine_glass, deep):
    same = trace(wine_glass, replace(ALL, cutoff=1e-13))  # less than the unit of account
    np.testing.assert_array_equal(same.radiance, deep.radiance)


def test_a_sample_spends_its_own_budget_on_its_smallest_branches():
    sample_buffer = SampleBuffer.zeros(2, 2, cutoff=0.25 / (1 - LIGHT_BUDGET) + 1e-9)
    sample = np.array([0, 1, 0, 0, 3, 1])
    weight = np.float32([0.125, 0.25, 0.0625, 0.1875, 0.5, 0.125])
    first = sample_buffer.cuttable(sample, weight)
    np.testing.assert_array_equal(first, [True, False, True, False, False, True])
    sample_buffer.add_residual(sample[first], weight[first])
    np.testing.assert_array_equal(sample_buffer.residual, [0.1875, 0.125, 0, 0])
    np.testing.assert_array_equal(sample_buffer.cuttable(sample, weight), [False, False, True, False, False, True])


@pytest.mark.parametrize(("different", "least"), [(2, 0.1), (5, 0.15), (1000, 0.2)])
def test_of_equal_branches_all_are_cut_or_none_exact(different, least):
    """The budget of each sample pays for some of its branches, of which many are equal."""
    random = np.random.default_rng(different)
    sample = random.integers(0, 300, 5000)
    weight = (random.integers(1, different + 1, 5000) / 2**13).astype(np.float32)
    sample_buffer = SampleBuffer.zeros(300, cutoff=float(weight.mean()) * 8)
    cut, expected = sample_buffer.cuttable(sample, weight), np.zeros(5000, bool)
    for owner in range(300):
        own = np.flatnonzero(sample == owner)
        for bound in np.unique(weight[own]):
            lighter = own[weight[own] <= bound]
            if (weight[lighter] / BUDGET_UNIT).astype(int).sum() <= sample_buffer.budget.limit:
                expected[lighter] = True
    np.testing.assert_array_equal(cut, expected)
    assert least < cut.mean() < 0.95


def test_light_is_cut_as_far_as_its_own_budget_goes_and_is_residual():
    cutoff = 2.0**-8
    most = cutoff * LIGHT_BUDGET * FAINT_LIGHT
    sample_buffer = SampleBuffer.zeros(2, 2, cutoff)
    share = np.float32([0.5, 0.25, 0, 2, 0.5]) * np.float32(most)
    np.testing.assert_array_equal(sample_buffer.cut_light(np.array([0, 0, 1, 1, 3]), share), [0, 1, 4])
    np.testing.assert_allclose(sample_buffer.residual, [0.75 * most, 0, 0, 0.5 * most], rtol=1e-6)
    many = np.full(int(1 / FAINT_LIGHT), most, np.float32)  # with what is spent, more than the budget: all or nothing
    assert len(sample_buffer.cut_light(np.zeros(len(many), int), many)) == 0
    assert len(sample_buffer.cut_light(np.full(len(many) // 2, 2), many[: len(many) // 2])) == len(many) // 2


def test_far_from_its_highlight_frosted_glass_asks_for_no_light(build):
    """And what that loses is within the residual, times what the lamp makes of a white wall."""
    lamp = PointLight("p", (2, -2, 2), (30, 30, 30))
    glass = build.glass(1.5, specular=(0.04,) * 3, layered=True, roughness=0.05)
    s = build.scene((build.icosphere(3, 1, smooth=True), glass), lights=(lamp,), world=World((0.5, 0.5, 0.5)))
    full, cut = trace(s, ALL), trace(s, replace(ALL, cutoff=CUTOFF))
    with without("faint-light"):
        cache = trace(s, replace(ALL, cutoff=CUTOFF))
    assert cut.rays["shadow"] < 0.5 * cache.rays["shadow"]
    assert any(e["what"] == "shadow rays" and "cutoff" in str(e["why"]) for e in cut.skipped)
    error = np.abs(cut.radiance.astype(float) - full.radiance).max(2)
    wall = 30 / 1.5**2 / np.pi  # metres from the lamp to the ball at least
    assert (error <= (cut.residual.astype(float) + full.residual) * wall + 1e-6).all()


@pytest.mark.parametrize("cutoff", [-1e-3, 1.0, float("nan")])
def test_a_cutoff_out_of_range_is_refused(build, cutoff):
    with pytest.raises(ValueError, match="cutoff"):
        trace(build.scene((build.box(), build.matte())), replace(ALL, cutoff=cutoff))


def test_a_wave_in_parts_gives_the_same_bits(monkeypatch):
    monkeypatch.setattr(whitted, "LONGEST_WAVE", 97)
    for blurred in (False, True):
        scene = effects.out_of_focus(effects.effects()) if blurred else effects.effects()
        assert effects.differ(shoot(scene, **effects.HYBRID), effects.reference(blurred)) == 0
