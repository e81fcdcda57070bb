# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties of the pure functions, on numbers that hypothesis chooses: from denormal to huge, on and around limits."""

import math

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from hybrid_addon import compositor, expressions
from hybrid_addon.measure.stability.build import make_scene, matte, mesh, rotation
from hybrid_addon.scene import Camera, Lens
from hybrid_addon.tracer.core.camera import generate_rays, near_plane, project, spread_on_lens
from hybrid_addon.tracer.core.rays import offset_origin, origin_offset, traceable
from hybrid_addon.tracer.core.sampler import disk
from hybrid_addon.tracer.core.vectors import dot, normalize, orthonormal_basis
from hybrid_addon.tracer.emitters.form_factors import form_factor
from hybrid_addon.tracer.emitters.located import range_window
from hybrid_addon.tracer.film.samples import SampleBuffer
from hybrid_addon.tracer.geometry.aggregate import barycentrics
from hybrid_addon.tracer.geometry.flatten import flatten
from hybrid_addon.tracer.geometry.shapes import plane_distance, sphere_distance
from hybrid_addon.tracer.materials.textures import lookup
from hybrid_addon.tracer.media.nested import relative_ior, transmittance
from hybrid_addon.tracer.shading.scattering import (
    both_faces,
    fresnel_dielectric,
    keep_outside,
    reflect,
    refract,
    schlick,
)

fast = settings(max_examples=40, deadline=None, derandomize=True)
unit = st.floats(0, 1)
eta = st.floats(-3, 3).map(lambda e: 10.0**e) | st.sampled_from([1.0, 1 - 2.0**-53, 1 + 2.0**-52, 1.5, 1 / 1.5])
scale = st.floats(-12, 12).map(lambda e: 10.0**e)
seeds = st.integers(0, 2**32 - 1)


def one(x):
    return np.array([x], np.float64)


def directions(seed, n=64):
    return normalize(np.random.default_rng(seed).normal(size=(3, n)))


# ------------------------------------------------------------------------------------------------ scattering


@fast
@given(unit, eta)
def test_fresnel_is_a_share_and_the_same_from_both_sides(cos, n):
    there = fresnel_dielectric(one(cos), one(n))[0]
    assert 0 <= there <= 1
    s2 = (1 - cos) * (1 + cos) / (n * n)
    if s2 >= 1:
        assert there == 1 or s2 < 1 + 1e-9
        return
    back = fresnel_dielectric(one(math.sqrt(1 - s2)), one(1 / n))[0]
    # An ulp of one cosine is max(n, 1 / n)^2 / cosine as much of the other.
    ill = max(n, 1 / n) ** 2 / max(min(cos, math.sqrt(1 - s2)), 1e-15)
    assert abs(there - back) <= 1e-12 + 1e-15 * ill


@fast
@given(seeds, eta)
def test_refraction_is_snells_is_a_unit_vector_and_can_be_reversed(seed, n):
    wo, normal = directions(seed), directions(seed + 1)
    normal *= np.sign(dot(wo, normal))
    cos = np.clip(dot(wo, normal), 0, 1)
    passes = (1 - cos) * (1 + cos) < n * n * (1 - 1e-6)
    wo, normal, cos = wo[:, passes], normal[:, passes], cos[passes]
    wt = refract(wo, normal, cos, np.full(cos.shape, n))
    assert (dot(wt, normal) <= 0).all()
    np.testing.assert_allclose(dot(wt, wt), 1, atol=1e-9)
    np.testing.assert_allclose(n * np.cross(wt, normal, axis=0), -np.cross(wo, normal, axis=0), atol=1e-9 * max(n, 1))
    back = refract(wt, -normal, np.clip(-dot(wt, normal), 0, 1), np.full(cos.shape, 1 / n))
    np.testing.assert_allclose(back, wo, atol=1e-6)


@fast
@given(seeds)
def test_reflection_is_its_own_inverse_and_what_is_lifted_leaves_outside(seed):
    wo, normal = directions(seed), directions(seed + 1)
    np.testing.assert_allclose(reflect(reflect(wo, normal), normal), wo, atol=1e-14)
    facing = normal * np.sign(dot(wo, normal))
    w = directions(seed + 2).astype(np.float32)
    lifted = keep_outside(w, facing.astype(np.float32), wo.astype(np.float32))
    assert (dot(lifted, facing) > 0).all()
    np.testing.assert_allclose(dot(lifted, lifted), 1, atol=1e-5)
    outside = dot(w, facing) > 0.02
    np.testing.assert_array_equal(lifted[:, outside], w[:, outside])


@fast
@given(unit, unit, unit)
def test_thin_walls_and_schlick_stay_shares(f, tint, cos):
    both, twice = both_faces(one(f), np.full((3, 1), tint), np.array([True]))
    assert f <= both[0] <= 1 and (twice <= tint).all()
    grown = schlick(np.float32([[f], [tint], [0]]), np.float32([cos]))
    assert (grown >= np.float32([[f], [tint], [0]]) - 1e-7).all() and (grown <= 1 + 1e-6).all()


@fast
@given(eta, st.booleans())
def test_relative_index_turns_over_with_the_side(n, entering):
    there, back = (relative_ior(one(n), np.array([side]))[0] for side in (entering, not entering))
    assert there * back == 1 or abs(there * back - 1) <= 2.0**-52


@fast
@given(st.floats(0, 1e6), st.floats(0, 1e6), st.floats(0, 1e6))
def test_what_absorbs_multiplies_along_the_way(sigma, a, b):
    table = np.array([[sigma, 0.0]] * 3)
    inside = np.zeros((1, 1), np.int32)
    share = [transmittance(table, inside, one(d))[0, 0] for d in (a, b, a + b, 0.0)]
    assert share[3] == 1 and 0 <= share[2] <= 1
    np.testing.assert_allclose(share[0] * share[1], share[2], rtol=1e-6, atol=1e-300)
    assert transmittance(table, inside + 1, one(np.inf))[0, 0] == 1  # vacuum, endless


# ------------------------------------------------------------------------------------------------ shapes and rays


@fast
@given(seeds, scale, st.floats(-4, 4))
def test_a_ray_meets_a_sphere_on_the_sphere(seed, size, off):
    rng = np.random.default_rng(seed)
    center, radius = rng.normal(size=3) * size, size * 10.0**off
    origin = (center[:, None] + directions(seed) * radius * rng.uniform(0, 5, 64)).astype(np.float32)
    direction = directions(seed + 1).astype(np.float32)
    t = sphere_distance(center, radius, origin, direction)
    hit = np.isfinite(t)
    assert (t[hit] > 0).all()
    point = origin[:, hit].astype(float) + t[hit] * direction[:, hit]
    gap = np.abs(np.sqrt(((point - center[:, None]) ** 2).sum(0)) - radius)
    assert (gap <= 1e-6 * radius + 1e-13 * np.abs(center).max()).all()
    inside = np.sqrt(((origin.astype(float) - center[:, None]) ** 2).sum(0)) < radius * (1 - 1e-3)
    inside &= np.abs(center).max() * 1e-6 < radius
    assert hit[inside].all()


@fast
@given(seeds, scale, scale)
def test_a_ray_meets_a_plane_in_the_plane(seed, size, away):
    n = directions(seed, 1)
    facet = np.concatenate([n, [[away]]])
    origin, d = directions(seed + 1) * size, directions(seed + 2)
    t, toward = plane_distance(facet, origin, d)
    steep = np.abs(toward) > 1e-3
    point = origin + t * d
    np.testing.assert_allclose((n * point).sum(0)[steep], away, atol=1e-11 * (size + away))


@fast
@given(seeds, scale)
def test_barycentrics_give_the_point_back(seed, size):
    rng = np.random.default_rng(seed)
    triangle = rng.normal(size=(3, 3)) * size
    g = flatten(make_scene((one_triangle(triangle), matte())), [{}])
    weights = rng.dirichlet(np.ones(3), 16).T
    corners = g.vertices[g.triangles[0]].astype(float)
    u, v = barycentrics(g, np.zeros(16, int), corners.T @ weights, clamp=False)
    np.testing.assert_allclose([1 - u - v, u, v], weights, atol=1e-6)
    far = corners.T @ weights + rng.normal(size=(3, 16)) * size
    u, v = barycentrics(g, np.zeros(16, int), far)
    assert (u >= 0).all() and (v >= 0).all() and (u + v <= 1 + 1e-15).all()


def one_triangle(corners):
    return mesh(corners, [(0, 1, 2)])


@fast
@given(seeds, scale, st.floats(-3, 6))
def test_new_rays_start_on_their_own_side_of_the_plane(seed, size, off):
    """The rounded origin lies beyond the plane by an ulp of the coordinates at least, however large they are."""
    rng = np.random.default_rng(seed)
    n = directions(seed)
    point = rng.normal(size=(3, 64)) * size + rng.normal(size=(3, 1)) * size * 10.0**off
    extent = np.abs(point).max(0).astype(np.float32)
    gap = origin_offset(point.astype(np.float32), extent)
    height = dot(offset_origin(point, n, gap).astype(float) - point, n)
    assert (height >= 2.0**-23 * np.abs(point).max(0)).all()


@fast
@given(st.lists(st.floats(width=32), min_size=6, max_size=6))
def test_only_sound_rays_are_traceable(numbers):
    ray = np.array(numbers, np.float32).reshape(2, 3, 1)
    sound = traceable(ray[0], ray[1])[0]
    if sound:
        assert np.isfinite(ray).all() and ray[1].any()
    elif np.isfinite(ray).all():  # but what overflows or vanishes in float32 is none
        with np.errstate(over="ignore"):
            d2, total = (ray[1] * ray[1]).sum(dtype=np.float32), ray[0].sum(dtype=np.float32)
        assert d2 == 0 or not np.isfinite(d2) or not np.isfinite(total)


@fast
@given(seeds)
def test_a_basis_is_orthonormal_and_right_handed(seed):
    n = np.concatenate([directions(seed), [[0, 0, 1], [0, 0, 0], [1, -1, 0]]], axis=1)
    t, b = orthonormal_basis(n)
    for x, y, expected in ((t, t, 1), (b, b, 1), (t, b, 0), (t, n, 0), (b, n, 0)):
        np.testing.assert_allclose(dot(x, y), expected, atol=1e-12)
    np.testing.assert_allclose(np.cross(t, b, axis=0), n, atol=1e-12)


# ------------------------------------------------------------------------------------------------ camera and film


@fast
@given(seeds, st.sampled_from(["PERSP", "ORTHO"]), st.floats(-3, 2), st.floats(-10, 10), st.booleans())
def test_what_a_ray_passes_is_projected_where_it_came_from(seed, projection, wide, shift, blurred):
    """And where it starts, the box of such places holds."""
    rng, half = np.random.default_rng(seed), 10.0**wide
    center = 0.2 * shift * half
    plane = (center - half, center + half, -half * 0.7, half * 0.7)
    matrix = rotation(seed % 1000)
    matrix[:3, 3] = rng.normal(size=3) * 10
    lens = Lens(0.25, 3.0, int(rng.integers(0, 9)), 0.3, 1.5) if blurred else None
    camera = Camera(projection, matrix, plane, (64, 48), (0, 0, 64, 48), 0.1, 1e6, lens)
    x, y = rng.uniform(0, 64, 32), rng.uniform(0, 48, 32)
    on_lens = None if lens is None else spread_on_lens(lens, rng.random(32), rng.random(32))
    # A scene around the camera, so that rays start at the clip plane.
    origin, d, t_max = generate_rays(camera, x, y, matrix[:3, 3], 1e6, on_lens)
    low, high = near_plane(camera, matrix[:3, 3])
    assert (low[:, None] <= origin).all() and (origin <= high[:, None]).all()
    along = np.minimum(rng.uniform(0.5, 4, 32), t_max)
    point = origin.astype(float) + along * d + matrix[:3, 3:]
    again = project(camera, point, on_lens)
    tolerance = 1e-3 * max(1, half) ** 2 if projection == "PERSP" else 1e-3 + 1e-4 / half
    np.testing.assert_allclose(again[0], x, atol=tolerance * 10 if blurred else tolerance)
    np.testing.assert_allclose(again[1], y, atol=tolerance * 10 if blurred else tolerance)


@fast
@given(seeds, st.integers(0, 12), st.floats(0.1, 10), st.floats(0, 7))
def test_points_on_disks_and_lenses_stay_on_them(seed, blades, ratio, rotation):
    rng = np.random.default_rng(seed)
    u, v = (np.concatenate([rng.random(64), [0, 1, 0, 1]]).astype(np.float32) for _ in range(2))
    x, y = disk(u, v)
    assert (x * x + y * y <= 1 + 1e-6).all()
    x, y = spread_on_lens(Lens(2.0, 1.0, blades, rotation, ratio), u, v)
    assert ((x * ratio) ** 2 + y * y <= 4 * (1 + 1e-5)).all()


# ------------------------------------------------------------------------------------------------ lights and textures


@fast
@given(seeds, st.integers(-26, 26))
def test_a_form_factor_is_a_share_that_knows_no_scale(seed, power):
    rng = np.random.default_rng(seed)
    middle, u, v = rng.normal(size=(3, 3)) * (2, 1, 1)
    corners = [middle + a * u + b * v for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    normal = directions(seed, 32).astype(np.float32)

    def factor(s):
        wide = [np.repeat((s * c)[:, None], 32, 1).astype(np.float32) for c in corners]
        return form_factor(wide, normal)

    share = factor(1.0)
    assert (share >= 0).all() and (share <= 1 + 1e-5).all()
    np.testing.assert_array_equal(factor(2.0**power), share)
    back = form_factor([np.repeat(c[:, None], 32, 1).astype(np.float32) for c in corners[::-1]], normal)
    np.testing.assert_allclose(back, share, atol=1e-5)  # of either winding


@fast
@given(st.floats(1e-6, 1e6), st.floats(0, 3))
def test_a_light_fades_to_nothing_within_its_range(reach, share):
    near, here, far = (range_window(np.float32([(s * reach) ** 2]), reach)[0] for s in (0, share, share * 1.1))
    assert near == 1 and 1 >= here >= far >= 0
    assert share < 1 or here <= 1e-6


@fast
@given(seeds, st.integers(1, 9), st.integers(1, 9), st.floats(-1e9, 1e9), st.floats(-2, 2), st.booleans())
def test_look_ups_lie_between_the_texels_and_repeat(seed, height, width, u, v, closest):
    pixels = np.random.default_rng(seed).random((height, width, 4)).astype(np.float32)
    for way in ("REPEAT", "EXTEND", "MIRROR", "CLIP"):
        found = lookup(pixels, one(u), one(v), way, way, closest)[:, 0]
        low = 0 if way == "CLIP" else pixels.min(axis=(0, 1)) - 1e-6
        assert (found >= low).all() and (found <= pixels.max(axis=(0, 1)) + 1e-6).all()
    assume(abs(u) < 1e3)
    period = {"REPEAT": 1, "MIRROR": 2}
    for way, step in period.items():
        a, b = (lookup(pixels, one(u + k * step), one(v), way, way, False) for k in (0, 3))
        np.testing.assert_allclose(a, b, atol=1e-8 * width * 1e3)
    for bad in (np.nan, np.inf, -np.inf, 1e300):
        assert np.isfinite(lookup(pixels, one(bad), one(v), "REPEAT", "REPEAT")).all()


# ------------------------------------------------------------------------------------------------ budgets and sums


@fast
@given(seeds, st.floats(1e-6, 0.5))
def test_the_cutoff_never_spends_more_than_its_budget(seed, cutoff):
    rng = np.random.default_rng(seed)
    sample_buffer = SampleBuffer.zeros(8, 2, cutoff, depth=5)
    for wave in range(6):
        if wave:
            sample_buffer.next_generation(np.arange(16))
        sample = rng.integers(0, 16, 60)
        weight = (10.0 ** rng.uniform(-9, 0, 60)).astype(np.float32)
        cut = np.flatnonzero(sample_buffer.cuttable(sample, weight))
        sample_buffer.add_residual(sample[cut], weight[cut])
        budget = sample_buffer.budget
        assert (budget.spent <= budget.released.take(sample_buffer.generation, mode="clip")).all()
    assert (sample_buffer.residual <= cutoff * (1 + 1e-6)).all()


# ------------------------------------------------------------------------------------------------ pictures and nodes


@fast
@given(seeds)
def test_both_halves_of_one_colour_are_that_colour(seed):
    rng = np.random.default_rng(seed)
    mask, color = rng.random((4, 5), np.float32), rng.random(3, np.float32) * 10
    raster = np.concatenate([color * (1 - mask[..., None]), 1 - mask[..., None]], axis=2)
    whole = raster + compositor.premultiply(np.broadcast_to(color, (4, 5, 3)), mask)
    np.testing.assert_allclose(whole, np.broadcast_to([*color, 1], (4, 5, 4)), atol=1e-5)


number = st.floats(-1e3, 1e3)


@fast
@given(st.tuples(number, number, number), st.tuples(number, number, number), number, number)
def test_operations_are_finite_on_constants(a, b, c, d):
    """Whatever numbers a node gets: what is folded is a finite number, or colour."""
    names = (
        "add", "subtract", "multiply", "divide", "minimum", "maximum", "screen", "overlay", "soft_light", "difference",
        "exclusion", "dodge", "burn", "power", "modulo", "snap", "pingpong", "logarithm", "dot", "cross",
    )  # fmt: skip
    for name in names:
        assert all_finite(expressions.apply(name, a, b)), name
    assert all_finite(expressions.apply("compare", a, b, abs(c)))
    for name in ("root", "floor", "fraction", "smooth", "exponent", "tangent", "arcsine", "normalize", "rgb_to_hsv"):
        assert all_finite(expressions.apply(name, a)), name
    assert all_finite(expressions.apply("wrap_between", c, d, a[0]))
    assert all_finite(expressions.apply("fresnel", c, abs(d)))


def all_finite(value):
    return np.isfinite(value).all()


@fast
@given(st.tuples(unit, unit, unit))
def test_hue_and_back_is_the_colour(color):
    hsv = expressions.apply("rgb_to_hsv", color)
    np.testing.assert_allclose(expressions.apply("hsv_to_rgb", hsv), color, atol=1e-9)
