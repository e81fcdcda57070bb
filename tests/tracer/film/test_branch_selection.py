# SPDX-License-Identifier: GPL-3.0-or-later
"""No sample becomes more than so many rays; those that are drawn by lot stand for the others."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import Settings, SunLight, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.core.constants import BUDGET_UNIT, MOST_RAYS, RAYS_AHEAD
from hybrid_addon.tracer.film import samples
from hybrid_addon.tracer.film.branch_selection import draw
from hybrid_addon.tracer.film.samples import SampleBuffer

DEFAULTS = Settings(samples=2, camera_sees="ALL", threads=1, max_depth=32, cutoff=1 / 255)
R = 0.04


def units(weights):
    return np.maximum((np.asarray(weights) / BUDGET_UNIT).astype(np.int64), 1)


def one_draw(weights, most, chance):
    n = len(weights)
    return draw(np.zeros(n, np.intp), units(weights), np.full(n, most), np.full(n, chance))


# ------------------------------------------------------------------------------------------------ the draw


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("most", [1, 2, 5, 16])
def test_a_draw_keeps_number_and_weight_and_leaves_the_heaviest_alone(seed, most):
    rng = np.random.default_rng(seed)
    weights = rng.random(40) ** 4 * 0.3
    for chance in rng.random(20):
        factor = one_draw(weights, most, chance)
        assert np.count_nonzero(factor) == most
        np.testing.assert_allclose((factor * weights).sum(), weights.sum(), rtol=1e-9)
        assert (factor[factor > 0] >= 1 - 1e-9).all()
        untouched = weights[factor == 1]
        if len(untouched):  # all that are heavier are untouched, too
            assert (factor[weights >= untouched.min()] == 1).all()


def test_of_equal_branches_the_draw_depends_on_their_order_alone():
    """Systematic resampling: of n equal ones, m are left, where floor((k + 1) m / n + u) > floor(k m / n + u)."""
    n, most, rng = 300, 7, np.random.default_rng(3)
    chance = rng.random(3)
    owner = np.sort(rng.integers(0, 3, n))
    rng.shuffle(owner)  # samples come mixed; each keeps the order of its own
    factor = draw(owner, np.full(n, 1000), np.full(n, most), chance[owner])
    for sample in range(3):
        own = factor[owner == sample]
        steps = np.floor(np.arange(len(own) + 1) * most / len(own) + chance[sample])
        np.testing.assert_array_equal(own > 0, np.diff(steps) > 0)


def test_a_draw_is_right_in_the_mean():
    weights = np.array([0.5, 0.2, 0.1, 0.05, 0.05, 0.02, 0.02, 0.01])
    chances = (np.arange(4096) + 0.5) / 4096
    mean = np.mean([one_draw(weights, 4, chance) for chance in chances], axis=0)
    np.testing.assert_allclose(mean, 1, atol=4e-3)


def test_what_is_drawn_of_a_sample_does_not_depend_on_the_others_exact():
    rng = np.random.default_rng(1)
    owner = rng.integers(0, 30, 900)
    cost, most = units(rng.random(900) ** 6), rng.integers(1, 9, 30)[owner]
    chance = rng.random(30)[owner]
    together = draw(owner, cost, most, chance)
    for number in range(30):
        own = owner == number
        np.testing.assert_array_equal(draw(owner[own], cost[own], most[own], chance[own]), together[own])


def test_few_branches_are_all_followed_and_counted():
    held = SampleBuffer.zeros(2, 1, cutoff=1 / 255)
    sample = np.array([0, 0, 1])
    assert held.drawn(sample, np.float32([0.5, 0, 0.25])) is None
    np.testing.assert_array_equal(held.followed, [1, 1])
    assert held.most_rays == MOST_RAYS


def test_what_is_left_out_is_residual_and_stood_for():
    n = 4 * MOST_RAYS // RAYS_AHEAD
    held = SampleBuffer.zeros(1, 1, cutoff=1 / 255)
    weight = np.full(n, 1 / n, np.float32)
    factor = held.drawn(np.zeros(n, np.intp), weight)
    assert np.count_nonzero(factor) == MOST_RAYS // RAYS_AHEAD == held.followed[0]
    np.testing.assert_allclose(held.residual, 0.75, rtol=1e-6)
    np.testing.assert_array_equal(held.residual, held.stood_for)
    np.testing.assert_allclose((factor * weight).sum(), 1, rtol=1e-6)


def test_a_lower_cutoff_and_rough_samples_ask_for_more_rays():
    assert SampleBuffer.zeros(1, cutoff=1e-4).most_rays == 10**4
    assert SampleBuffer.zeros(1, cutoff=1 / 255, first=8).most_rays == 8 * MOST_RAYS
    assert SampleBuffer.zeros(1).most_rays == 0  # without a cutoff there is no limit


# ------------------------------------------------------------------------------------------------ stacked glass


def stack(build, count, gap=0.5, thickness=0.04, white=False, fills=False, size=(16, 12), ior=1.5):
    panes = [(build.box((-1, gap * k, -1), (1, gap * k + thickness, 1)), build.glass(ior)) for k in range(count)]
    if fills:
        panes = [(replace(m, vertices=m.vertices * np.float32((40, 1, 40))), s) for m, s in panes]
    floor = build.quad([(-9, -9, -1), (9, -9, -1), (9, 9, -1), (-9, 9, -1)])
    cam = build.camera((0.4, -4, 0.6), (0, 0, 0), (0, 0, 1), size, 0.3)
    parts = panes if white else [*panes, (floor, build.matte((0.6, 0.5, 0.4)))]
    sun = () if white else (SunLight("sun", (0.3, -0.5, 1), (2, 2, 2)),)
    world = World((1.0, 1.0, 1.0)) if white else World((0.6, 0.7, 0.9))
    return build.scene(*parts, camera=cam, world=world, lights=sun)


def shells(build, count, size=(12, 9)):
    parts = []
    for k in range(count):
        outer, inner = build.icosphere(3, 1 - 0.15 * k, True), build.icosphere(3, 0.95 - 0.15 * k, True)
        n = len(outer.vertices)
        shell = build.mesh(
            np.concatenate([outer.vertices, inner.vertices]),
            np.concatenate([outer.triangles, inner.triangles[:, ::-1] + n]),
            normals=np.concatenate([outer.normals, -inner.normals]),
        )
        parts.append((shell, build.glass(1.5)))
    cam = build.camera((0, -3, 0.6), (0, 0, 0), (0, 0, 1), size, 0.3)
    floor = build.quad([(-9, -9, -1), (9, -9, -1), (9, 9, -1), (-9, 9, -1)])
    return build.scene(*parts, (floor, build.matte((0.6, 0.5, 0.4))), camera=cam, world=World((0.6, 0.7, 0.9)))


def each(film):
    return (film.rays["reflected"] + film.rays["refracted"] + film.rays["straight"]) / film.rays["camera"]


@pytest.mark.parametrize("fills", [False, True])
@pytest.mark.parametrize("count", [3, 6, 12, 24])
def test_panes_take_a_bounded_number_of_rays(build, count, fills):
    film = trace(stack(build, count, fills=fills), DEFAULTS)
    assert each(film) <= MOST_RAYS
    assert film.residual.max() <= 1 + 1e-6


@pytest.mark.once
@pytest.mark.parametrize("make", ["3 panes", "6 panes", "9 panes", "3 shells", "5 shells"])
def test_the_mean_is_that_of_all_rays_and_the_error_within_the_residual(build, make):
    count, kind = int(make[0]), make[2:]
    scene = stack(build, count) if kind == "panes" else shells(build, count)
    film, reference = trace(scene, DEFAULTS), trace(scene, replace(DEFAULTS, cutoff=1 / 4000))
    assert each(film) <= MOST_RAYS < each(reference) or count == 3
    error = film.radiance.astype(float) - reference.radiance
    glass = film.residual > 0
    assert abs(error[glass].mean()) < 0.01
    assert np.sqrt((error[glass] ** 2).mean()) < 0.05
    brightest = 2.0
    bound = (film.residual.astype(float) + reference.residual) * brightest
    assert (np.abs(error).max(axis=2) <= bound + 1e-6).all()


def test_through_six_panes_comes_what_the_closed_form_says(build):
    """T of n interfaces is (1 - R) / (1 + (n - 1) R); of white all that is neither let through comes back."""
    cam = replace(build.camera((0.1, -6, 0.1), (0.1, 0, 0.1), (0, 0, 1), (8, 8)), projection="ORTHO")
    scene = stack(build, 6, white=True)
    wall = build.quad([(-9, 5, -9), (9, 5, -9), (9, 5, 9), (-9, 5, 9)])
    scene = build.scene(
        *[(m, build.glass(1.5)) for m in scene.meshes],
        (wall, build.emitter(1, 1, 1)),
        world=World((0, 0, 0)),
        camera=cam,
    )
    film = trace(scene, replace(DEFAULTS, samples=16))
    assert film.radiance.mean() == pytest.approx((1 - R) / (1 + 11 * R), abs=4e-3)


def test_a_white_furnace_stays_white_where_rays_stand_for_others(build):
    film = trace(stack(build, 6, white=True, fills=True), replace(DEFAULTS, max_depth=120))
    light = film.radiance.astype(float)
    assert film.residual.max() > 0.05  # some were left out
    np.testing.assert_allclose(light, 1, atol=1 / 255 + 1e-6)
    assert (light <= 1 + 1e-6).all()


@pytest.mark.parametrize(("threads", "chunk"), [(1, 64), (2, 1000)])
def test_threads_and_chunks_draw_the_same_rays_exact(build, threads, chunk):
    scene = stack(build, 6)
    one, other = trace(scene, DEFAULTS), trace(scene, replace(DEFAULTS, threads=threads, chunk=chunk))
    np.testing.assert_array_equal(one.radiance, other.radiance)
    np.testing.assert_array_equal(one.residual, other.residual)


def test_a_window_draws_what_the_whole_picture_draws_exact(build):
    scene = stack(build, 6)
    part = replace(scene, camera=replace(scene.camera, window=(4, 2, 12, 10)))
    plain = replace(DEFAULTS, filter_radius=0.5)
    np.testing.assert_array_equal(trace(part, plain).radiance[1:-1, 1:-1], trace(scene, plain).radiance[3:9, 5:11])


def test_other_seeds_draw_other_rays(build):
    scene = stack(build, 9)
    films = [trace(scene, replace(DEFAULTS, seed=seed, samples=1)) for seed in (0, 1)]
    assert (films[0].radiance != films[1].radiance).any()


def test_without_a_cutoff_many_at_once_are_drawn_from(monkeypatch):
    monkeypatch.setattr(samples, "MAX_BRANCHES", 4)
    held = SampleBuffer.zeros(3)
    sample = np.array([0] * 3 + [1] * 6 + [2] * 4 + [1] * 2)
    weight = np.float32([9, 9, 9, 1, 5, 2, 7, 3, 0, 1, 1, 1, 1, 6, 2])
    factor = held.drawn(sample, weight)
    assert np.flatnonzero(factor[weight > 0] != 1).size > 0
    assert [np.count_nonzero(factor[(sample == s) & (weight > 0)]) for s in range(3)] == [3, 4, 4]
    assert factor[6] == 1 != factor[13]  # 7 is more than a quarter of 26, 6 less than a third of the other 19
