# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import Expression, Settings, Sphere, Surface, Texture, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.emitters.world import CompiledWorld
from hybrid_addon.tracer.materials.textures import lookup, sample_equirect, sample_texture


def image(values):
    """Grey pixels (h, w) to (h, w, 4)."""
    return np.repeat(np.array(values, np.float32)[..., None], 4, axis=2)


RAMP = image([[0, 1, 2, 3]])


def grey(u, extension, closest=False, pixels=RAMP):
    u = np.atleast_1d(np.float64(u))
    return lookup(pixels, u, np.full_like(u, 0.5), extension, extension, closest)[0]


def test_texel_centres_are_exact_and_between_them_it_is_linear():
    np.testing.assert_allclose(grey([1 / 8, 3 / 8, 1 / 2, 7 / 8], "EXTEND"), [0, 1, 1.5, 3])


@pytest.mark.parametrize(
    ("extension", "expected"),
    [("EXTEND", [0, 3, 3]), ("REPEAT", [1.5, 1.5, 1]), ("MIRROR", [0, 3, 2]), ("CLIP", [0, 1.5, 0])],
)
def test_extension_modes_at_and_beyond_the_border(extension, expected):
    np.testing.assert_allclose(grey([0, 1, 1 + 3 / 8], extension), expected)


def test_closest_takes_the_texel_itself():
    np.testing.assert_allclose(grey([0.01, 0.24, 0.26, 0.99], "REPEAT", closest=True), [0, 0, 1, 3])


def test_rows_go_up():
    pixels = image([[0], [1]])
    u = np.array([0.5, 0.5])
    np.testing.assert_allclose(lookup(pixels, u, np.array([0.25, 0.75]), "EXTEND", "EXTEND")[0], [0, 1])


def test_mapping_is_applied():
    texture = Texture("t", RAMP, "REPEAT", "CLOSEST", uv_transform=np.array([[0, 1, 0.25], [1, 0, 0]]))
    np.testing.assert_allclose(sample_texture(texture, np.array([0.5]), np.array([0.1]))[0], [1])


def test_tiles_lie_beside_each_other_and_what_has_none_shows_the_pixels():
    tiles = {(0, 0): image([[1.0]]), (1, 0): RAMP, (0, 2): image([[7.0]])}
    texture = Texture("t", image([[9.0]]), tiles=tiles)
    u, v = (
        np.array([0.5, 1 + 1 / 8, 2 - 1e-9, 0.5, 0.5, 2.5, -0.5, 1e9]),
        np.array([0.5, 0.5, 0.5, 2.5, 1.5, 0.5, 0, 0.5]),
    )
    np.testing.assert_allclose(sample_texture(texture, u, v)[0], [1, 0, 3, 7, 9, 9, 9, 9])
    moved = replace(texture, uv_transform=np.array([[1, 0, 0], [0, 1, 2.0]]))
    np.testing.assert_allclose(sample_texture(moved, u[:2], v[:2])[0], [7, 9])


def test_coordinates_that_are_not_finite_do_no_harm():
    assert np.isfinite(grey([np.nan, np.inf, 1e300], "EXTEND")[:2]).all()


def test_equirect_directions():
    # Columns of 8: the centre is +X, u = .25 is +Y, u = .75 is -Y, the border -X; v = 1 is up.
    pixels = np.zeros((4, 8, 4), np.float32)
    pixels[..., 0] = np.arange(8)
    pixels[..., 1] = np.arange(4)[:, None]
    texture = Texture("sky", pixels, interpolation="CLOSEST")
    e = 1e-3
    directions = np.array([(1, -e, e), (e, 1, e), (-e, -1, e), (-1, e, e), (0.1, 0, 1), (0.1, 0, -1)], float).T
    got = sample_equirect(texture, directions)
    np.testing.assert_array_equal(got[0, :4], [4, 2, 6, 0])
    np.testing.assert_array_equal(got[1], [2, 2, 2, 2, 3, 0])


def test_equirect_has_no_seam():
    texture = Texture("sky", np.random.default_rng(0).random((4, 8, 4)).astype(np.float32))
    both = sample_equirect(texture, np.array([(-1, 1e-9, 0.2), (-1, -1e-9, 0.2)]).T)
    np.testing.assert_allclose(both[:, 0], both[:, 1], atol=1e-6)


def test_the_world_is_seen_behind_everything_and_can_be_turned(build):
    pixels = np.zeros((4, 8, 4), np.float32)
    pixels[:, 1:3] = (1, 2, 3, 1)  # towards +Y
    sky = Texture("sky", pixels, interpolation="CLOSEST")
    cam = build.camera((0, 0, 0), (0, 1, 0), (0, 0, 1), half=0.1)
    s = build.scene(camera=cam, world=World((0.5, 0.5, 0.5), sky))
    settings = Settings(samples=1, camera_sees="ALL", threads=1)
    np.testing.assert_allclose(trace(s, settings).radiance, np.broadcast_to([0.5, 1, 1.5], (16, 16, 3)))
    turned = replace(s.world, rotation=np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]]))  # +Y looks up +X
    np.testing.assert_array_equal(trace(replace(s, world=turned), settings).radiance, 0)


def test_diffuse_light_of_a_linear_sky_is_exact():
    # L(w) = 1 + w.a has E(n)/pi = 1 + (2/3) a.n: first order harmonics say all there is to say.
    h, w = 64, 128
    lat = (np.arange(h) + 0.5) / h * np.pi - np.pi / 2
    lon = -2 * np.pi * ((np.arange(w) + 0.5) / w - 0.5)
    lat, lon = np.meshgrid(lat, lon, indexing="ij")
    d = np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])
    a = np.array([0.3, -0.5, 0.2])
    pixels = np.repeat((1 + np.tensordot(a, d, 1))[..., None], 4, axis=2).astype(np.float32)
    n = np.random.default_rng(0).normal(size=(3, 50))
    n /= np.linalg.norm(n, axis=0)
    got = CompiledWorld(World((2.0, 1.0, 0.5), Texture("sky", pixels))).irradiance_over_pi(n.astype(np.float32))
    expected = np.array([[2.0], [1.0], [0.5]]) * (1 + 2 / 3 * (a @ n))
    np.testing.assert_allclose(got, expected, rtol=1e-3)


def test_uv_maps_by_name_and_the_wrapping_of_a_picture(build):
    first, second = np.float32([(0, 0), (1, 0), (1, 1), (0, 1)]), np.float32([(1, 0), (0, 0), (0, 1), (1, 1)])
    quad = build.quad(
        [(-2.5, -2.5, 0), (2.5, -2.5, 0), (2.5, 2.5, 0), (-2.5, 2.5, 0)], uv_maps={"": first, "b": second}
    )
    settings = Settings(samples=1, camera_sees="ALL", threads=1)

    def row(**other):
        texture = Texture("ramp", RAMP, "REPEAT", "CLOSEST", **other)
        s = build.scene((quad, Surface(base_color=Expression("image", (), texture))), world=World((1, 1, 1)))
        return trace(s, settings).radiance[8, :, 0]

    np.testing.assert_allclose(row(), np.repeat([0, 1, 2, 3], 4))
    np.testing.assert_allclose(row(uv_map="b"), np.repeat([3, 2, 1, 0], 4))
    np.testing.assert_allclose(row(uv_map="lost"), row())  # a map that is not there: the active one


def test_a_texture_on_a_sphere_and_through_a_triangle_slot(build):
    texture = Texture("ramp", image([[0], [1]]), "EXTEND", "CLOSEST")
    cam = build.camera((0, -4, 0), up=(0, 0, 1), half=0.1)
    s = build.scene(
        camera=cam, surfaces=(Surface(base_color=Expression("image", (), texture)),), world=World((1, 1, 1))
    )
    s = replace(s, spheres=(Sphere("ball", (0, 0, 0), 1.0, 0),))
    got = trace(s, Settings(samples=1, camera_sees="ALL", threads=1)).radiance[..., 0]
    np.testing.assert_array_equal(got[:8], 0)
    np.testing.assert_array_equal(got[8:], 1)
    behind = build.quad(
        [(-1, -9, -1), (1, -9, -1), (1, -9, 1), (-1, -9, 1)], uv_maps={"": np.zeros((4, 2), np.float32)}
    )
    both = replace(s, meshes=(behind,), instances=(build.instance(0),))
    np.testing.assert_array_equal(trace(both, Settings(samples=1, camera_sees="ALL", threads=1)).radiance[..., 0], got)


@pytest.mark.parametrize("slot", [1, 2, 2**31 - 1])
def test_each_triangle_wears_the_surface_of_its_slot(build, slot):
    """Or the last one: however many are missing, they take no memory."""
    quad = build.quad([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], surface_slots=np.int32([0, slot]))
    s = build.scene(surfaces=(build.emitter(1, 0, 0), build.emitter(0, 1, 0)))
    s = replace(s, meshes=(quad,), instances=(build.instance(0, (0, 1)),))
    got = trace(s, Settings(samples=1, camera_sees="ALL", threads=1)).radiance
    np.testing.assert_array_equal(got[2, 13], [1, 0, 0])  # the first triangle is the lower right one
    np.testing.assert_array_equal(got[13, 2], [0, 1, 0])
