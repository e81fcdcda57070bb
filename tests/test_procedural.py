# SPDX-License-Identifier: GPL-3.0-or-later
"""Procedural textures without Blender: against values that EEVEE drew, and facts about noise.

The values are EEVEE's pixels (5.2, half floats; 4.5's are the same where not noted) of planes that emit the node's
value at (u, v, 0.6 u - 0.1) with W = u, at the two places in PLACES.
"""

from __future__ import annotations

import functools

import numpy as np
import pytest

from hybrid_addon import expressions as ex
from hybrid_addon.procedural import TEXTURES, cells, hashes, noise
from hybrid_addon.scene import Expression

PLACES = np.array([[7.5, 18.5], [4.5, 15.5]]) / 24
POINT = np.stack([*PLACES, 0.6 * PLACES[0] - 0.1]).astype(np.float32)
W = POINT[:1]
HALF = 0.0026  # of values stored as 0.25 x + 0.5 in half floats that were rounded down, and to 3 digits

NOISES = [
    (1, "FBM", (0.492, 0.414, 0.281), (0.402, 0.49, 0.57)),
    (1, "MULTIFRACTAL", (0.947, 0.68, 0.17), (0.641, 0.918, 1.326)),
    (1, "HETERO_TERRAIN", (0.4, 0.131, -0.637), (0.184, 0.527, 0.553)),
    (1, "HYBRID_MULTIFRACTAL", (0.312, 0.115, -0.513), (0.164, 0.578, 0.494)),
    (1, "RIDGED_MULTIFRACTAL", (0.084, 0.012, 0.277), (0.031, 0.012, 0.074)),
    (2, "FBM", (0.627, 0.625, 0.455), (0.42, 0.654, 0.473)),
    (2, "MULTIFRACTAL", (1.592, 1.582, 0.801), (0.699, 1.668, 0.879)),
    (2, "HETERO_TERRAIN", (0.77, 1.029, 0.43), (0.166, 1.285, 0.438)),
    (2, "HYBRID_MULTIFRACTAL", (0.75, 0.975, 0.408), (0.176, 1.125, 0.41)),
    (2, "RIDGED_MULTIFRACTAL", (0.033, 0.004, 0.029), (0.021, 0.109, 0.045)),
    (3, "FBM", (0.561, 0.584, 0.365), (0.559, 0.516, 0.543)),
    (3, "MULTIFRACTAL", (1.27, 1.391, 0.516), (1.266, 0.982, 1.176)),
    (3, "HETERO_TERRAIN", (0.707, 0.693, 0.021), (0.625, -0.008, 0.564)),
    (3, "HYBRID_MULTIFRACTAL", (0.615, 0.555, 0.018), (0.564, -0.004, 0.572)),
    (3, "RIDGED_MULTIFRACTAL", (0.012, 0.033, 0), (0.035, 0, 0.041)),
    (4, "FBM", (0.605, 0.504, 0.482), (0.479, 0.553, 0.5)),
    (4, "MULTIFRACTAL", (1.473, 1.006, 0.896), (0.91, 1.219, 0.992)),
    (4, "HETERO_TERRAIN", (0.971, 0.357, 0.439), (0.385, 0.656, 0.289)),
    (4, "HYBRID_MULTIFRACTAL", (0.855, 0.355, 0.359), (0.385, 0.662, 0.258)),
    (4, "RIDGED_MULTIFRACTAL", (0.004, 0.064, 0.049), (0.086, 0.016, 0.039)),
]  # fmt: skip

DISTORTED = [
    (1, 0.676, 0.281),
    (2, 0.357, 0.836),
    (3, 0.41, 0.436),
    (4, 0.484, 0.387),
]  # fmt: skip

CELLS = [
    (1, "F1", "Distance", (0.582,), (0.775,)),
    (1, "F1", "Color", (0.223, 1.029, 0.857), (1.221, 0.84, 1.303)),
    (1, "F1", "W", (0.279,), (0.877,)),
    (1, "F2", "Distance", (0.893,), (1.764,)),
    (1, "F2", "Color", (1.123, 0.514, 1.156), (0.23, 1.035, 0.84)),
    (1, "F2", "W", (0.309,), (0.527,)),
    (1, "SMOOTH_F1", "Distance", (0.541,), (0.746,)),
    (1, "SMOOTH_F1", "Color", (0.389, 0.969, 0.943), (1.104, 0.9, 1.24)),
    (1, "SMOOTH_F1", "W", (0.316,), (0.834,)),
    (2, "F1", "Distance", (0.586,), (0.527,)),
    (2, "F1", "Color", (0.449, 0.637, 0.279), (1.08, 0.572, 0.574)),
    (2, "F1", "Position", (0.266, 0.209, 0), (0.748, 0.686, 0)),
    (2, "F2", "Distance", (0.699,), (1.215,)),
    (2, "F2", "Color", (1.305, 0.43, 1.189), (1.197, 0.801, 0.709)),
    (2, "F2", "Position", (0.307, 0.137, 0), (0.717, 0.488, 0)),
    (2, "SMOOTH_F1", "Distance", (0.492,), (0.527,)),
    (2, "SMOOTH_F1", "Color", (0.705, 0.504, 0.537), (1.082, 0.572, 0.574)),
    (2, "SMOOTH_F1", "Position", (0.279, 0.174, 0), (0.748, 0.686, 0)),
    (3, "F1", "Distance", (1.148,), (1.18,)),
    (3, "F1", "Color", (0.928, 1.027, 1.023), (1.277, 0.912, 0.828)),
    (3, "F1", "Position", (0.213, 0.219, -0.001), (0.67, 0.615, 0.422)),
    (3, "F2", "Distance", (1.516,), (1.348,)),
    (3, "F2", "Color", (0.43, 0.709, 0.277), (1.148, 0.779, 1.109)),
    (3, "F2", "Position", (0.232, 0.176, 0.031), (0.801, 0.588, 0.391)),
    (3, "SMOOTH_F1", "Distance", (1.082,), (1.023,)),
    (3, "SMOOTH_F1", "Color", (0.818, 0.781, 0.801), (1.209, 0.732, 0.926)),
    (3, "SMOOTH_F1", "Position", (0.225, 0.178, 0.031), (0.732, 0.613, 0.381)),
    (4, "F1", "Distance", (0.949,), (0.879,)),
    (4, "F1", "Color", (0.93, 0.83, 0.396), (0.67, 0.609, 0.506)),
    (4, "F1", "Position", (0.227, 0.195, 0.059), (0.734, 0.721, 0.381)),
    (4, "F2", "Distance", (1.242,), (1.143,)),
    (4, "F2", "Color", (0.527, 0.848, 0.578), (0.477, 1.035, 1.002)),
    (4, "F2", "Position", (0.314, 0.123, 0.219), (0.709, 0.619, 0.236)),
    (4, "SMOOTH_F1", "Distance", (0.898,), (0.797,)),
    (4, "SMOOTH_F1", "Color", (0.836, 0.779, 0.461), (0.578, 0.6, 0.594)),
    (4, "SMOOTH_F1", "Position", (0.242, 0.188, 0.082), (0.729, 0.684, 0.348)),
]  # fmt: skip

CELLS_OF_45 = [
    (2, "Distance", (0.398,), (1.094,)),
    (2, "Color", (1.287, 0.727, 1.418), (1.443, 0.602, 1.414)),
    (3, "Distance", (1.098,), (0.715,)),
    (3, "Color", (0.998, 0.143, 1.311), (1.402, 1.006, 1.186)),
    (4, "Distance", (1.416,), (1.074,)),
    (4, "Color", (0.719, 1.104, 0.893), (0.861, 0.875, 0.498)),
]  # fmt: skip

METRICS = [
    (1, "MANHATTAN", 0.178, 0.494),
    (1, "CHEBYCHEV", 0.178, 0.494),
    (1, "MINKOWSKI", 0.178, 0.494),
    (2, "MANHATTAN", 0.262, 0.205),
    (2, "CHEBYCHEV", 0.311, 0.252),
    (2, "MINKOWSKI", 0.26, 0.205),
    (3, "MANHATTAN", 0.432, 0.41),
    (3, "CHEBYCHEV", 0.6, 0.531),
    (3, "MINKOWSKI", 0.393, 0.4),
    (4, "MANHATTAN", 0.25, 0.266),
    (4, "CHEBYCHEV", 0.523, 0.49),
    (4, "MINKOWSKI", 0.225, 0.244),
]  # fmt: skip

EDGES = [
    (1, 0, 0.102, 0.371),
    (1, 1.4, 0.092, 0.258),
    (2, 0, 0.031, 0.27),
    (2, 1.4, 0.029, 0.23),
    (3, 0, 0.135, 0.01),
    (3, 1.4, 0.184, 0.014),
    (4, 0, 0.119, 0.049),
    (4, 1.4, 0.113, 0.041),
]  # fmt: skip

RADII = [
    (1, 0.281, 0.453),
    (2, 0.391, 0.412),
    (3, 0.338, 0.342),
    (4, 0.291, 0.406),
]  # fmt: skip

WAVES = [
    ("BANDS", "X", "SAW", 0.0, 0.76, 0.779),
    ("BANDS", "Y", "TRI", 1.4, 0.861, 0.994),
    ("BANDS", "Z", "SIN", 1.4, 0.369, 0.154),
    ("BANDS", "DIAGONAL", "SAW", 1.4, 0.666, 0.045),
    ("RINGS", "X", "TRI", 0.0, 0.949, 0.57),
    ("RINGS", "Y", "SIN", 1.4, 0.541, 0.014),
    ("RINGS", "Z", "SAW", 1.4, 0.824, 0.303),
    ("RINGS", "SPHERICAL", "TRI", 1.4, 0.303, 0.889),
]  # fmt: skip

MAGIC = [
    (0, (0.633, 0.395, 0.219), (0.838, 0.848, 0.855)),
    (1, (0.686, 0.992, 0.105), (0.973, 0.604, 0.998)),
    (2, (0.014, 0.992, 0.105), (0.031, 0.604, 0.998)),
    (5, (0.531, 0.209, 0.939), (0.236, 0.256, 0.312)),
    (10, (0.68, 0.242, 0.984), (0.895, 0.32, 0.682)),
]  # fmt: skip

GABOR = [
    (2, 1, 0, 0.508, 0.674),
    (2, 1, 1, 0.504, 0.812),
    (2, 1, 2, 0.506, 0.377),
    (2, 0.3, 0, 0.461, 0.52),
    (2, 0.3, 1, 0.463, 0.521),
    (2, 0.3, 2, 0.348, 0.312),
    (3, 1, 0, 0.594, 0.586),
    (3, 1, 1, 0.596, 0.898),
    (3, 1, 2, 0.33, 0.293),
    (3, 0.3, 0, 0.428, 0.496),
    (3, 0.3, 1, 0.359, 0.004),
    (3, 0.3, 2, 0.186, 0.152),
]  # fmt: skip


def column(value):
    return np.full((1, 1), value, np.float32)


def texture(name, *inputs):
    *numbers, data = inputs
    return TEXTURES[name](*(n if isinstance(n, np.ndarray) else column(n) for n in numbers), data)


def agrees(found, *values):
    found = np.broadcast_to(found, (len(values[0]), 2)).T
    assert np.abs(found - np.array(values)).max() < HALF


# ------------------------------------------------------------------------------------------------ as EEVEE


@pytest.mark.parametrize(("dimensions", "kind", "first", "second"), NOISES)
def test_noise(dimensions, kind, first, second):
    numbers = (3.3, 2.6, 0.6, 2.1, 0.3, 1.2, 0.0)
    found = texture("noise_color", POINT, W, *numbers, (dimensions, kind, True))
    agrees(found, first, second)
    assert np.array_equal(texture("noise", POINT, W, *numbers, (dimensions, kind, True)), found[:1])


@pytest.mark.parametrize(("dimensions", "first", "second"), DISTORTED)
def test_distorted_noise(dimensions, first, second):
    agrees(texture("noise", POINT, W, 3.3, 0, 0.5, 2, 0, 1, 1.7, (dimensions, "FBM", True)), (first,), (second,))


@functools.cache
def some_cells(dimensions, feature, hashed="PCG"):
    numbers = (3.1, 1.5, 0.5, 2, 0.7, 0.5, 0.9)
    return texture("voronoi", POINT, W, *numbers, (dimensions, feature, "EUCLIDEAN", False, hashed))


@pytest.mark.parametrize(("dimensions", "feature", "output", "first", "second"), CELLS)
def test_cells(dimensions, feature, output, first, second):
    found = some_cells(dimensions, feature)
    rows = {"Distance": cells.DISTANCE, "Color": cells.COLOR, "Position": cells.POSITION, "W": cells.W}[output]
    agrees(found[slice(*rows)], first, second)


@pytest.mark.parametrize(("dimensions", "output", "first", "second"), CELLS_OF_45)
def test_cells_as_blender_45_has_them(dimensions, output, first, second):
    rows = {"Distance": cells.DISTANCE, "Color": cells.COLOR}[output]
    agrees(some_cells(dimensions, "F1", "LOOKUP3")[slice(*rows)], first, second)


@pytest.mark.parametrize(("dimensions", "metric", "first", "second"), METRICS)
def test_metrics(dimensions, metric, first, second):
    found = texture("voronoi", POINT, W, 3.1, 0, 0.5, 2, 1, 0.7, 1, (dimensions, "F1", metric, True, "PCG"))
    agrees(found[:1], (first,), (second,))


@pytest.mark.parametrize(("dimensions", "detail", "first", "second"), EDGES)
def test_distance_to_the_edge(dimensions, detail, first, second):
    settings = dimensions, "DISTANCE_TO_EDGE", "EUCLIDEAN", detail > 0, "PCG"
    agrees(texture("voronoi", POINT, W, 3.1, detail, 0.5, 2, 1, 0.5, 1, settings)[:1], (first,), (second,))


@pytest.mark.parametrize(("dimensions", "first", "second"), RADII)
def test_n_sphere_radius(dimensions, first, second):
    found = texture(
        "voronoi", POINT, W, 3.1, 0, 0.5, 2, 1, 0.5, 1, (dimensions, "N_SPHERE_RADIUS", "EUCLIDEAN", False, "PCG")
    )
    agrees(found[slice(*cells.RADIUS)], (first,), (second,))


@pytest.mark.parametrize(("kind", "direction", "profile", "distortion", "first", "second"), WAVES)
def test_waves(kind, direction, profile, distortion, first, second):
    found = texture("wave", POINT, 0.7, distortion, 2.5, 1.3, 0.5, 0.4, (kind, direction, profile))
    agrees(found, (first,), (second,))


@pytest.mark.parametrize(("depth", "first", "second"), MAGIC)
def test_magic(depth, first, second):
    agrees(texture("magic", POINT, 1.2, 1.4, depth), first, second)


@functools.cache
def some_gabor(dimensions, anisotropy):
    direction = np.array([[np.sqrt(2)], [np.sqrt(2)], [0]])
    return texture("gabor", POINT, 2.2, 1.7, anisotropy, np.pi / 4, direction, dimensions)


@pytest.mark.parametrize(("dimensions", "anisotropy", "row", "first", "second"), GABOR)
def test_gabor(dimensions, anisotropy, row, first, second):
    found = some_gabor(dimensions, anisotropy)
    agrees(found[row : row + 1], (first,), (second,))


def test_bricks():
    red, green, blue = (np.array(c)[:, None] for c in ((0.8, 0.2, 0.1), (0.2, 0.7, 0.3), (0.1, 0.1, 0.5)))
    found = texture("brick", red, green, blue, POINT, 4, 0.02, 0.1, 0.1, 0.5, 0.25, (0.5, 2, 1.0, 2))
    agrees(found, (0.1, 0.1, 0.5), (0.414, 0.52, 0.227))
    grey = texture("brick", column(0.8), column(0.2), column(0), POINT, 5, 0.05, 0.8, 0, 0.5, 0.25, (0.3, 2, 1.7, 3))
    agrees(grey, (0.729,) * 3, (0.074,) * 3)
    agrees(texture("brick_factor", POINT, 5, 0.05, 0.8, 0, 0.5, 0.25, (0.5, 2, 1.0, 2)), (0.0,), (0.818,))


# ------------------------------------------------------------------------------------------------ facts


def some_points(n=500, seed=1):
    return np.random.default_rng(seed).uniform(-20, 20, (3, n)).astype(np.float32)


def test_no_two_corners_of_a_lattice_have_the_same_hash():
    corner = np.stack(np.meshgrid(*[np.arange(-8, 8, dtype=np.int32)] * 3)).reshape(3, -1)
    assert len(np.unique(hashes.jenkins(*hashes.words(*corner)))) == corner.shape[1]


@pytest.mark.parametrize("dimensions", [1, 2, 3, 4])
def test_gradient_noise_is_0_on_the_lattice_and_smooth_between(dimensions):
    whole = np.arange(-5, 5, dtype=np.float32) * np.ones((dimensions, 1), np.float32)
    assert not noise.perlin(whole).any()
    near, step = some_points()[:1] * np.ones((dimensions, 1), np.float32), np.float32(1e-3)
    assert np.abs(noise.perlin(near + step) - noise.perlin(near)).max() < 0.02


@pytest.mark.parametrize("kind", list(noise.FRACTALS))
def test_a_detail_of_its_own_at_each_hit(kind):
    p, details = some_points(), (0.0, 1.0, 2.6, 15.0)
    settings = (3, kind, True)

    def at(detail):
        return texture("noise", p, 0.0, 1.1, detail, 0.7, 2.1, 0.4, 1.3, 0.5, settings)

    mixed = at(np.resize(np.array(details, np.float32), (1, p.shape[1])))
    for i, detail in enumerate(details):
        assert np.allclose(mixed[:, i::4], at(detail)[:, i::4], rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("feature", ["F1", "F2", "SMOOTH_F1", "DISTANCE_TO_EDGE"])
def test_octaves_of_cells_of_their_own_at_each_hit(feature):
    p, details = some_points(60), (0.0, 1.0, 2.6)

    def at(detail):
        return texture("voronoi", p, 0.0, 1.1, detail, 0.7, 2.1, 0.4, 1, 0.9, (3, feature, "EUCLIDEAN", True, "PCG"))

    mixed = at(np.resize(np.array(details, np.float32), (1, p.shape[1])))
    for i, detail in enumerate(details):
        assert np.allclose(mixed[:, i::3], at(detail)[:, i::3], rtol=1e-5, atol=1e-6)


def test_cells_without_randomness_are_a_lattice():
    p = some_points()
    found = texture("voronoi", p, 0.0, 1, 0, 0.5, 2, 1, 1, 0, (3, "F1", "EUCLIDEAN", False, "PCG"))
    assert np.allclose(found[0], np.sqrt(((p - np.floor(p + 0.5)) ** 2).sum(0)), atol=1e-5)
    assert np.allclose(found[slice(*cells.POSITION)], np.floor(p + 0.5), atol=1e-5)


def test_the_edge_is_half_way_between_two_points():
    def distance(feature):
        return texture("voronoi", p, 0.0, 1, 0, 0.5, 2, 1, 1, 1, (3, feature, "EUCLIDEAN", False, "PCG"))[0]

    p = some_points()
    near, far, edge = distance("F1"), distance("F2"), distance("DISTANCE_TO_EDGE")
    assert (edge > (far - near) / 2 - 1e-4).all()
    assert (edge < (far + near) / 2 + 1e-4).all()


@pytest.mark.parametrize("dimensions", [1, 2, 3, 4])
def test_white_noise_is_uniform_and_its_rows_are_independent(dimensions):
    p = some_points(20000)
    value, tint = texture("white_noise", p, p[:1], dimensions), texture("white_noise_color", p, p[:1], dimensions)
    assert np.array_equal(value[0], tint[0])
    assert np.abs(np.quantile(tint, (0.25, 0.5, 0.75), axis=1) - [[0.25], [0.5], [0.75]]).max() < 0.02
    assert np.abs(np.corrcoef(tint) - np.eye(3)).max() < 0.03


def test_numbers_alone_are_worked_out_at_once_and_points_at_hits():
    settings = (3, "FBM", True)
    constant = ex.apply("noise", (0.3, 0.2, 0.1), 0.0, 5.0, 2.0, 0.5, 2.0, 0.0, 1.0, 0.0, data=settings)
    point = Expression("attribute", (), "generated")

    class Hits:
        def attribute(self, key):
            return np.tile(np.array([[0.3], [0.2], [0.1]], np.float32), 4)

    varying = ex.apply("noise", point, 0.0, 5.0, 2.0, 0.5, 2.0, 0.0, 1.0, 0.0, data=settings)
    assert ex.Evaluation(Hits())(varying) == pytest.approx(np.full((1, 4), constant), abs=1e-6)


def test_wild_coordinates_stay_finite():
    p = np.array([[1e30, -1e30, 1e8, 0, 3e9], [0, 1e12, -1e8, 0, 1], [1, 2, 3, 0, 1]], np.float32)
    with np.errstate(all="ignore"):
        for kind in noise.FRACTALS:
            assert np.isfinite(texture("noise", p, 0.0, 5, 2, 0.5, 2, 0.2, 1, 1, (3, kind, True))).all()
        texture("voronoi", p, 0.0, 5, 2, 0.5, 2, 1, 1, 1, (3, "F1", "EUCLIDEAN", False, "PCG"))
        assert np.isfinite(texture("brick_factor", p, 5, 0.05, 0.8, 0, 0.0, 0.0, (0.5, 2, 1.0, 2))[:, 3:4]).all()


# ------------------------------------------------------------------------------------------------ coordinates


def rotation(axis, angle):
    """(3, 3) about an axis."""
    k = np.array(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def test_a_mapping_with_settings_that_vary_is_the_matrix_where_they_do_not():
    p, location, angles, scale = some_points(9), (0.3, -1, 2), (0.4, -0.7, 1.9), (2, 0.5, -1.5)
    matrix = rotation((0, 0, 1), 1.9) @ rotation((0, 1, 0), -0.7) @ rotation((1, 0, 0), 0.4)
    there = [np.array(a, float)[:, None] for a in (location, angles, scale)]
    mapping = ex.OPERATIONS["mapping"]
    expected = matrix @ (p * there[2])
    np.testing.assert_allclose(mapping(p, *there, "POINT"), expected + there[0], atol=1e-5)
    np.testing.assert_allclose(mapping(p, *there, "VECTOR"), expected, atol=1e-5)
    np.testing.assert_allclose(mapping(mapping(p, *there, "POINT"), *there, "TEXTURE"), p, atol=1e-4)
    np.testing.assert_allclose(mapping(p, *there, "NORMAL"), matrix @ (p / there[2]), atol=1e-4)


def test_vectors_turn_about_an_axis_and_by_angles():
    p, center, axis = some_points(9), np.array([[1.0], [2], [3]]), np.array([[1.0], [-2], [0.5]])
    about, turned = ex.OPERATIONS["turned_about"], ex.OPERATIONS["turned"]
    expected = center + rotation(axis[:, 0], 0.8) @ (p - center)
    np.testing.assert_allclose(about(p, center, axis, np.full((1, 1), 0.8)), expected, atol=1e-5)
    np.testing.assert_allclose(about(p, center, 0 * axis, np.full((1, 1), 0.8)), p, atol=1e-5)
    angles = np.array([[0.4], [-0.7], [1.9]])
    matrix = rotation((0, 0, 1), 1.9) @ rotation((0, 1, 0), -0.7) @ rotation((1, 0, 0), 0.4)
    np.testing.assert_allclose(turned(p, center, angles, False), center + matrix @ (p - center), atol=1e-5)
    np.testing.assert_allclose(turned(p, center, angles, True), center + matrix.T @ (p - center), atol=1e-5)
