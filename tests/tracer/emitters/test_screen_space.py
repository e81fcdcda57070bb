# SPDX-License-Identifier: GPL-3.0-or-later
"""Raster-backed hits: rasters with a known answer, what must fall back, and what may not change."""

from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import Expression, Plane, PointLight, Raster, Settings, Surface, Visibility, World
from hybrid_addon.tracer import CompiledScene, trace, trace_compiled
from hybrid_addon.tracer.core.camera import project
from hybrid_addon.tracer.core.constants import NO_DEPTH
from hybrid_addon.tracer.emitters.screen_space import is_matte
from tests.tracer.unpruned import without

SETTINGS = Settings(samples=1, threads=1, passes=frozenset({"raster_backed", "reflection", "refraction"}))
SIZE = 64
WALL_Y = 4.0
EYE = (3.5, -2, 4)


def centres(camera):
    """Film positions of the pixels' centres on the view plane."""
    left, right, bottom, top = camera.view_plane
    x = left + (np.arange(camera.resolution[0]) + 0.5) / camera.resolution[0] * (right - left)
    y = bottom + (np.arange(camera.resolution[1]) + 0.5) / camera.resolution[1] * (top - bottom)
    return np.meshgrid(x, y)


def eevee(camera, color, mirror_height=0.0):
    """The raster half: the wall y = WALL_Y in the colour color(x, z) above the mirror floor, which is held out."""
    x, y = centres(camera)
    m = camera.matrix_world
    q = np.stack([x, y, -np.ones_like(x)], -1)
    if camera.projection == "PERSP":
        direction, origin = q @ m[:3, :3].T, np.broadcast_to(m[:3, 3], q.shape)
    else:
        direction, origin = np.broadcast_to(-m[:3, 2], q.shape), m[:3, 3] + q[..., :2] @ m[:3, :2].T
    t_wall, t_floor = (WALL_Y - origin[..., 1]) / direction[..., 1], -origin[..., 2] / direction[..., 2]
    floor = (t_floor > 0) & (t_floor < t_wall)
    depth = np.where(floor, t_floor, t_wall)
    at = origin + direction * depth[..., None]
    pixels = np.concatenate([color(at[..., 0], at[..., 2]), np.ones((*depth.shape, 1))], -1)
    pixels[floor] = 0
    return Raster(pixels.astype(np.float32), depth.astype(np.float32)), floor


def gradient(x, z):
    """A colour that is nearly linear over the wall."""
    return np.stack([0.5 + 0.05 * x, 0.5 + 0.1 * z, np.full_like(x, 0.25)], -1)


def room(build, *more, wall=None, projection="PERSP", eye=EYE, **other):
    """A ray traced mirror floor before a wall, seen obliquely; dark but for what the raster knows."""
    view = build.camera(eye, (-1, 4, 0.4), (0, 0, 1), (SIZE, SIZE))
    if projection == "ORTHO":
        view = replace(view, projection=projection, view_plane=(-3.0, 3.0, -3.0, 3.0))
    corners = [(-50, WALL_Y, -1), (50, WALL_Y, -1), (50, WALL_Y, 50), (-50, WALL_Y, 50)]
    floor = build.quad([(-50, -50, 0), (50, -50, 0), (50, WALL_Y, 0), (-50, WALL_Y, 0)], "floor")
    return build.scene(
        (floor, build.mirror()), (build.quad(corners, "wall"), wall or build.matte(), {"ray_traced": False}), *more,
        camera=view, **other,
    )  # fmt: skip


def mirrored_wall(camera):
    """(x, z) of the wall where the floor at each pixel mirrors it."""
    x, y = centres(camera)
    m = camera.matrix_world
    if camera.projection == "PERSP":
        direction, origin = np.stack([x, y, -np.ones_like(x)], -1) @ m[:3, :3].T, m[:3, 3]
    else:
        direction = np.broadcast_to(-m[:3, 2], (*x.shape, 3))
        origin = m[:3, 3] + np.stack([x, y], -1) @ m[:3, :2].T
    t = (WALL_Y - origin[..., 1]) / direction[..., 1]
    at = origin + direction * t[..., None]
    return at[..., 0], -at[..., 2]


def on_screen(camera, floor):
    """Whether the wall that the floor at each pixel mirrors is in the picture, with all that is looked at around it."""
    x, z = mirrored_wall(camera)
    column, row, depth = project(camera, np.stack([x.ravel(), np.full(x.size, WALL_Y), z.ravel()]))
    column, row = (i.reshape(x.shape) - 0.5 for i in (column, row))
    inside = (np.minimum(column, row) > 0.01) & (np.maximum(column, row) < SIZE - 1.01) & (depth.reshape(x.shape) > 0)
    above = ~floor & np.roll(~floor, 1, 0)  # not beside the wall's foot
    j, i = np.where(inside, row, 0).astype(int), np.where(inside, column, 0).astype(int)
    return inside & above[j, i] & above[j, np.minimum(i + 1, SIZE - 1)]


@pytest.mark.parametrize(("projection", "eye"), [("PERSP", EYE), ("PERSP", (-0.7, 0, 6)), ("ORTHO", EYE)])
def test_a_mirror_shows_the_raster_s_wall(build, projection, eye):
    dark = room(build, projection=projection, eye=eye)
    raster, floor = eevee(dark.camera, gradient)
    film = trace(replace(dark, raster=raster), SETTINGS)
    backed = film.passes["raster_backed"]
    x, z = mirrored_wall(dark.camera)
    assert set(np.unique(backed)) == {0, 1}
    assert (backed[~floor] == 0).all()
    shown = (backed == 1)[floor & on_screen(dark.camera, floor)]
    assert shown.all() if projection == "PERSP" else shown.mean() > 0.99  # parallel rays meet pixels' borders
    np.testing.assert_allclose(film.radiance[backed == 1], gradient(x, z)[backed == 1], atol=2e-4)
    assert not film.radiance[floor & (backed == 0)].any()  # off screen: our own shading, and nothing shines there
    assert film.hits == {"backed": np.count_nonzero(backed), "not_backed": np.count_nonzero(floor & (backed == 0))}
    np.testing.assert_array_equal(film.passes["reflection"], film.radiance)
    assert not film.passes["refraction"].any()


def test_what_is_mirrored_off_screen_is_shaded_as_ever(build):
    lit = room(build, world=World((1.0, 1.0, 1.0)), wall=build.matte((0.5, 0.5, 0.5)))
    raster, floor = eevee(lit.camera, lambda x, z: np.full((*x.shape, 3), 0.5))
    film = trace(replace(lit, raster=raster), SETTINGS)
    backed = film.passes["raster_backed"]
    assert 0.2 < backed[floor].mean() < 0.9
    np.testing.assert_allclose(film.radiance[floor], 0.5, rtol=1e-5)  # no seam where both agree


@pytest.mark.parametrize("change", ["depth", "sky", "held out", "nothing"])
def test_where_the_raster_shows_something_else_it_is_not_asked(build, change):
    dark = room(build)
    raster, _ = eevee(dark.camera, gradient)
    depth, pixels = raster.depth.copy(), raster.pixels.copy()
    if change == "depth":
        depth *= 0.95
    elif change == "sky":
        depth[:] = NO_DEPTH
    elif change == "held out":
        pixels *= 0.4
    film = trace(replace(dark, raster=Raster(pixels, depth)), SETTINGS)
    assert bool(film.radiance.any()) == bool(film.hits["backed"]) == (change == "nothing")


def test_what_is_held_out_of_a_pixel_does_not_darken_it(build):
    dark = room(build)
    raster, _ = eevee(dark.camera, gradient)
    whole = trace(replace(dark, raster=raster), SETTINGS)
    part = trace(replace(dark, raster=Raster(raster.pixels * np.float32(0.75), raster.depth)), SETTINGS)
    np.testing.assert_allclose(part.radiance, whole.radiance, rtol=1e-5)


def test_of_a_material_that_is_not_followed_any_pixel_around_will_do(build):
    matte, unknown = room(build), room(build, wall=build.matte(approximate=True))
    raster, _ = eevee(matte.camera, gradient)
    some, more = (trace(replace(s, raster=raster), SETTINGS) for s in (matte, unknown))
    backed, beside = some.passes["raster_backed"] == 1, more.passes["raster_backed"] == 1
    assert (beside & backed == backed).all()
    np.testing.assert_array_equal(more.radiance[backed], some.radiance[backed])
    foot = beside & ~backed  # where the wall meets the mirror
    assert foot.sum() > SIZE / 2
    x, z = mirrored_wall(matte.camera)
    np.testing.assert_allclose(more.radiance[foot], gradient(x, z)[foot], atol=0.03)


def test_no_pixel_beside_an_edge_is_used(build):
    """A pole before the wall, one pixel wide and red, that our geometry does not have in its mirror image."""
    dark = room(build)
    raster, _ = eevee(dark.camera, gradient)
    raster.depth[30:, 30] = 2.0
    raster.pixels[30:, 29:32, :3] = (9, 0, 0)  # the filter spreads it over its neighbours
    film = trace(replace(dark, raster=raster), SETTINGS)
    assert film.hits["backed"] > 100
    assert film.radiance.max() < 1


def test_the_other_side_of_a_sheet_is_not_what_the_raster_shows(build):
    """The mirror behind a sheet shows its back, the raster its front."""
    mirror = build.quad([(-50, 9, -50), (-50, 9, 50), (50, 9, 50), (50, 9, -50)], "mirror")
    sheet = build.quad([(-1, 4, -1), (1, 4, -1), (1, 4, 1), (-1, 4, 1)], "sheet")
    view = build.camera((-4, -6, 1), (0, 4, 1), (0, 0, 1), (SIZE, SIZE))
    s = build.scene((mirror, build.mirror()), (sheet, build.matte(), {"ray_traced": False}), camera=view)
    film = trace(replace(s, raster=eevee(view, gradient)[0]), SETTINGS)
    assert film.hits["backed"] == 0
    assert film.hits["not_backed"] > 0


@pytest.mark.parametrize("clear", [True, False])
def test_glass_that_has_no_depth_hides_the_wall(build, clear):
    """A blended pane between eye and wall, off the floor's own view of it."""
    pane = build.quad([(-9, 3, 0.3), (9, 3, 0.3), (9, 3, 9), (-9, 3, 9)], "pane")
    surface = Surface(opacity=0.0, ior=1.0) if clear else build.matte()
    seen = {"ray_traced": False, "visibility": Visibility(secondary=False, camera=clear)}
    dark = room(build, (pane, surface, seen))
    raster, _ = eevee(dark.camera, gradient)
    free, veiled = (trace(replace(s, raster=raster), SETTINGS).hits["backed"] for s in (room(build), dark))
    assert (veiled < 0.5 * free) if clear else (veiled == free)


MATTE = Surface(roughness=0.9, specular=(0.04,) * 3)


@pytest.mark.parametrize(
    ("surface", "matte"),
    [
        (Surface(), True),
        (MATTE, True),
        (replace(MATTE, roughness=0.5), False),
        (replace(MATTE, roughness=Expression("attribute", (), "position")), False),
        (replace(MATTE, specular=Expression("attribute", (), "position")), False),
        (replace(MATTE, coat=0.5), False),
        (replace(MATTE, sheen=0.5), False),
        (replace(MATTE, base_color=Expression("attribute", (), "position"), emission=(1, 2, 3)), True),
    ],
)
def test_what_counts_as_matte(build, surface, matte):
    assert is_matte(surface) == matte
    raster, _ = eevee(room(build).camera, gradient)
    assert bool(trace(replace(room(build, wall=surface), raster=raster), SETTINGS).hits["backed"]) == matte


@pytest.mark.parametrize("surface", [Surface(reflectivity=0.5), Surface(opacity=0.5), Surface(specular=(0.5,) * 3)])
@pytest.mark.parametrize("approximate", [True, False])
def test_the_raster_is_asked_for_view_dependent_surfaces_only_where_we_know_less(build, surface, approximate):
    dark = room(build, wall=replace(surface, approximate=approximate))
    raster, _ = eevee(dark.camera, gradient)
    assert bool(trace(replace(dark, raster=raster), SETTINGS).hits["backed"]) == approximate


def test_flagged_objects_are_never_backed(build):
    dark = room(build)
    raster, _ = eevee(dark.camera, gradient)
    ray_traced = replace(dark, instances=tuple(replace(i, ray_traced=True) for i in dark.instances), raster=raster)
    assert trace(ray_traced, SETTINGS).hits == {"backed": 0, "not_backed": 0}  # not even looked for


# ------------------------------------------------------------------------------------------------ what may not change

LIGHT = PointLight("p", (0, 0, 3), (30, 30, 30), radius=0.2)


def same(one, other):
    for name in ("radiance", "coverage", "residual"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


@pytest.mark.parametrize("settings", [{"samples": 4}, {"samples": 16, "adaptive": 0.1}, {"samples": 4, "cutoff": 0.01}])
def test_a_raster_that_backs_nothing_changes_no_bit(build, settings):
    s = room(build, lights=(LIGHT,), world=World((0.1, 0.2, 0.3)))
    raster, _ = eevee(s.camera, gradient)
    nothing = Raster(raster.pixels, np.full_like(raster.depth, NO_DEPTH))
    settings = Settings(threads=1, **settings)
    bare = trace(s, settings)
    same(bare, trace(replace(s, raster=nothing), settings))
    glossy = room(build, lights=(LIGHT,), world=World((0.1, 0.2, 0.3)), wall=Surface(specular=(0.5,) * 3))
    bare = trace(glossy, settings)
    pruned = trace(replace(glossy, raster=raster), settings)
    assert pruned.hits == {"backed": 0, "not_backed": 0}
    same(bare, pruned)
    with without("screen-space"):
        same(bare, trace(replace(glossy, raster=raster), settings))


def test_threads_chunks_and_passes_change_no_bit(build):
    s = room(build, lights=(LIGHT,), world=World((0.1, 0.2, 0.3)))
    s = replace(s, raster=eevee(s.camera, gradient)[0])
    one = trace(s, replace(SETTINGS, samples=4))
    other = trace(s, replace(SETTINGS, samples=4, threads=3, chunk=97))
    same(one, other)
    same(one, trace(s, replace(SETTINGS, samples=4, passes=frozenset())))
    for name in SETTINGS.passes:
        np.testing.assert_array_equal(one.passes[name], other.passes[name])


def test_traced_shadows_lie_on_what_backs_hits_too(build):
    """EEVEE draws without them; what is mirrored has them, as the picture has."""
    pole = build.quad([(-0.5, 3, 0), (0.5, 3, 0), (0.5, 3, 1), (-0.5, 3, 1)], "pole")
    s = room(build, (pole, build.mirror()), lights=(LIGHT,), world=World((0.1, 0.2, 0.3)))
    raster, _ = eevee(s.camera, gradient)
    s = replace(s, raster=raster)
    film = trace(s, replace(SETTINGS, raster_shadows=True))
    assert film.shadow.min() < 0.9
    dark = raster.pixels * np.dstack([film.shadow, np.ones((SIZE, SIZE))]).astype(np.float32)
    given = trace(replace(s, raster=Raster(dark, raster.depth)), SETTINGS)
    same(film, given)
    assert not np.array_equal(film.radiance, trace(s, SETTINGS).radiance)


def test_a_frame_leaves_the_prepared_scene_as_it_was(build):
    """Traced shadows lie on the raster in their own frame, not in the next one of the same scene."""
    pole = build.quad([(-0.5, 3, 0), (0.5, 3, 0), (0.5, 3, 1), (-0.5, 3, 1)], "pole")
    s = room(build, (pole, build.mirror()), lights=(LIGHT,), world=World((0.1, 0.2, 0.3)))
    raster, _ = eevee(s.camera, gradient)
    settings = replace(SETTINGS, raster_shadows=True)
    compiled = CompiledScene(replace(s, raster=raster), settings)
    without = compiled.seen_from(compiled.camera, replace(settings, raster_shadows=False))
    first, shadowed, again = (trace_compiled(scene) for scene in (without, compiled, without))
    assert not np.array_equal(first.radiance, shadowed.radiance)
    same(first, again)
    same(shadowed, trace_compiled(compiled))


def test_reflection_and_refraction_are_the_parts_of_the_picture(build):
    """The light of a glass ball over a floor, without what it gives off itself, is what its two rays bring."""
    ball = Surface(opacity=0.0, ior=1.5, emission=(0.25, 0.5, 0.75))
    s = build.scene(
        (build.icosphere(3), ball), planes=(Plane("floor", (0, 0, -1.5), (0, 0, 1), 1),), lights=(LIGHT,),
        surfaces=(ball, build.matte((0.2, 0.4, 0.6))), world=World((0.1, 0.2, 0.3)),
    )  # fmt: skip
    film = trace(s, replace(SETTINGS, samples=4))
    seen = film.coverage > 0
    sum_of_parts = film.passes["reflection"] + film.passes["refraction"] + np.float32([0.25, 0.5, 0.75])
    np.testing.assert_allclose(sum_of_parts[seen], film.radiance[seen], rtol=1e-5)
    middle = film.passes["refraction"][8, 8], film.passes["reflection"][8, 8]
    assert middle[0].min() > 3 * middle[1].max() > 0  # head-on glass reflects 4 % of the world and of itself


@pytest.mark.parametrize("key", ["ray:Is Camera Ray", "cosine"])
@pytest.mark.parametrize("approximate", [True, False])
def test_the_raster_knows_nothing_of_what_other_rays_are_told(build, key, approximate):
    """A wall that glows for the camera alone is dark in the mirror, whatever the raster shows of it."""
    glow = Expression("attribute", (), key)
    told = room(build, wall=Surface(base_color=(0, 0, 0), emission=glow, approximate=approximate))
    raster, _ = eevee(told.camera, gradient)
    film = trace(replace(told, raster=raster), SETTINGS)
    assert bool(film.hits["backed"]) == (approximate and key == "cosine")
    if key != "cosine":
        assert not film.radiance.any()
