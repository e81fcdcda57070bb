# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras at the ends of their range, measured through whole pictures: a colour ramp says where each pixel looked."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ...scene import Camera, Expression, Float64, Panorama, Scene, SunLight, Surface, Visibility
from ...tracer.core.panorama import MAPPINGS, directions, places
from . import build
from .case import Measured, Theme
from .compare import different_pixels, largest

THEME = Theme("Cameras, clip planes, borders")
TURN = build.look_at((3, -7, 2), (0.1, 0.2, 0.3))
"""Where the cameras stand and look: no axis of theirs is an axis of the world."""


def ramp_scene(lens: Camera, distance: float, window: tuple[float, float, float, float]) -> Scene:
    """A sunlit colour ramp across the camera's view at `distance`, over `window` (x0, y0, x1, y1) of its view plane."""
    m = np.asarray(lens.matrix_world, np.float64)
    x0, y0, x1, y1 = window
    reach = distance if lens.projection == "PERSP" else 1.0
    local = [(x * reach, y * reach, -distance) for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]
    middle = np.mean(local, axis=0)
    to_world = m.copy()
    to_world[:3, 3] += m[:3, :3] @ middle
    screen = build.quad(np.array(local) - middle, "screen", uv_maps={"": build.RAMP_UVS})
    paper = Surface(base_color=Expression("image", (), build.ramp()), ambient=0.0)
    sun = SunLight("sun", tuple(m[:3, 2]), (np.pi,) * 3, cast_shadow=False)
    return build.make_scene((screen, paper, {"matrix_world": to_world}), camera=lens, lights=(sun,))


def looked_at(scene: Scene, window: tuple[float, float, float, float], **settings: Any) -> Float64:
    """(h, w, 2): where on the view plane each pixel looked, out of the colours of the picture."""
    rgb = build.shoot(scene, **settings).radiance.astype(np.float64)
    share = rgb[..., :2] / rgb[..., 2:]
    return np.asarray(np.array(window[:2]) + share * (np.array(window[2:]) - window[:2]))


def pixel_error(lens: Camera, distance: float) -> float:
    """The largest distance, in pixels, between where a pixel should look and where it does."""
    left, right, bottom, top = lens.view_plane
    width, height = lens.resolution
    window = (left, bottom, right, top)
    got = looked_at(ramp_scene(lens, distance, window), window)
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    px = (got[..., 0] - left) / (right - left) * width
    py = (got[..., 1] - bottom) / (top - bottom) * height
    return max(largest(px, x), largest(py, y))


def lens_of(tangent: float, size: tuple[int, int] = (96, 64), shift: float = 0.0, **other: Any) -> Camera:
    """A camera whose frame reaches `tangent` to each side, shifted by so many of its widths."""
    half, up = tangent, tangent * size[1] / size[0]
    plane = (-half + shift * 2 * half, half + shift * 2 * half, -up - shift * up, up - shift * up)
    return build.camera(size=size, **{"view_plane": plane, "matrix_world": TURN, "clip_start": 1e-6, **other})


PIXEL = "every ray goes through the centre of its own pixel"


@THEME.case(31, "lens-of-50-degrees", "an ordinary perspective camera", PIXEL, 1e-4, "pixels")
def _() -> Measured:
    return Measured(max(pixel_error(lens_of(np.tan(np.radians(25))), d) for d in (0.1, 10.0, 1e3)))


@THEME.case(31, "lens-of-a-tenth-of-a-degree", "field of view 0.1 degrees, 1 m to 10 km away", PIXEL, 1e-4, "pixels")
def _() -> Measured:
    return Measured(max(pixel_error(lens_of(np.tan(np.radians(0.05))), d) for d in (1.0, 100.0, 1e4)))


@THEME.case(31, "lens-of-179-degrees", "field of view 179 degrees", PIXEL, 1e-4, "pixels")
def _() -> Measured:
    # So flat a view magnifies the rounding of the screen's own corners to 2e-4 pixels: turned by thirds, with a tangent
    # of nine times few bits, they are exact in float32, and the rays alone are measured.
    turn = np.array(((2, -1, 2, 9), (2, 2, -1, -21), (-1, 2, 2, 6), (0, 0, 0, 3))) / 3
    return Measured(max(pixel_error(lens_of(9 * 12.75, matrix_world=turn), d) for d in (2.0**-7, 1.0, 2.0**7)))


@THEME.case(31, "shift-of-ten", "the frame shifted by ten widths", PIXEL, 1e-4, "pixels")
def _() -> Measured:
    return Measured(max(pixel_error(lens_of(0.36, shift=s), d) for s in (-10.0, 10.0) for d in (1.0, 100.0)))


@THEME.case(31, "orthographic-scales", "orthographic cameras 1e-4, 1 and 1e6 m wide", PIXEL, 1e-4, "pixels")
def _() -> Measured:
    sizes = (5e-5, 0.5, 5e5)
    return Measured(max(pixel_error(lens_of(s, projection="ORTHO"), 10.0 * s) for s in sizes))


@THEME.case(31, "odd-pixels", "pixels twice as wide as high; frames of 1 x 1, 1 x 64, 3 x 5", PIXEL, 1e-4, "pixels")
def _() -> Measured:
    wide = lens_of(0.4)
    left, right, bottom, top = wide.view_plane
    found = [pixel_error(replace(wide, view_plane=(left, right, bottom / 2, top / 2)), 5.0)]
    found += [pixel_error(lens_of(0.4, size), 5.0) for size in ((1, 1), (1, 64), (64, 1), (3, 5))]
    return Measured(max(found))


@THEME.case(31, "panoramas", "each kind of panorama, to a place in the frame and back", PIXEL, 1e-4, "pixels")
def _() -> Measured:
    u, v = (place.ravel() for place in np.meshgrid(*2 * [(np.arange(64) + 0.5) / 64]))
    worst = 0.0
    for kind in MAPPINGS:
        panorama = Panorama(kind, polynomial=(0.0, -0.05, 0.0, 1e-6, 0.0))
        direction = directions(panorama, u, v)
        shown = np.isfinite(direction[0])
        back = np.stack(places(panorama, direction[:, shown])) - np.stack([u[shown], v[shown]])
        worst = max(worst, 64 * float(np.abs(back).max()))
    return Measured(worst)


@THEME.case(31, "unknown-projection", "a camera of a kind that there is not", "refused in one line", 0, "not refused")
def _() -> Measured:
    odd: Any = "CUSTOM"
    try:
        build.shoot(build.make_scene(camera=build.camera(projection=odd)))
    except ValueError as error:
        return Measured(int("\n" in str(error)), str(error))
    return Measured(1)


@THEME.case(
    32, "tile-of-a-huge-frame", "the corner and the middle of a frame of 16384 x 16384 pixels", PIXEL, 1e-4, "pixels"
)
def _() -> Measured:
    worst, size = 0.0, 16384
    for corner in (0, 8176, size - 16):
        lens = build.camera(
            size=(size, size), matrix_world=TURN, window=(corner, corner, corner + 16, corner + 16), half=0.5
        )
        low, high = corner / size - 0.5, (corner + 16) / size - 0.5
        window = (low, low, high, high)
        got = looked_at(ramp_scene(lens, 5.0, window), window)
        x, y = np.meshgrid(corner + np.arange(16) + 0.5, corner + np.arange(16) + 0.5)
        worst = max(worst, largest((got[..., 0] + 0.5) * size, x), largest((got[..., 1] + 0.5) * size, y))
    return Measured(worst, "three tiles of 16 x 16 pixels")


@THEME.case(
    32,
    "border-is-a-part-of-the-whole",
    "a render border in a filtered picture of 8 samples",
    "the same pixels, bit by bit",
    0,
    "pixels",
)
def _() -> Measured:
    from .invariance import everything

    whole = everything()
    border = replace(whole, camera=replace(whole.camera, window=(17, 5, 60, 49)))
    a = build.shoot(border, samples=8, max_depth=5).radiance
    b = build.shoot(whole, samples=8, max_depth=5).radiance
    return Measured(different_pixels(a, b[5:49, 17:60]), f"{a.shape[1]} x {a.shape[0]} of 72 x 54 pixels")


# ------------------------------------------------------------------------------------------------ clip planes


def seen(clip_start: float, clip_end: float) -> int:
    """Pixels in which camera rays see a wall 5 m away, of 1024."""
    scene = build.make_scene(
        (build.floor(9), build.emitter()), camera=build.camera(clip_start=clip_start, clip_end=clip_end)
    )
    return int(np.count_nonzero(build.shoot(scene, camera_sees="RAY_TRACED").coverage))


@THEME.case(
    30,
    "clip-planes",
    "clip start 1e-6, clip end 1e9; ends just before and just behind a wall",
    "the wall is seen or is not",
    0,
    "pixels",
)
def _() -> Measured:
    visible = ((1e-6, 1e9), (4.999, 5.001), (1e-6, 5.0001), (4.9999, 1e9))
    hidden = ((5.0001, 1e9), (1e-6, 4.9999), (6.0, 7.0))
    return Measured(
        sum(1024 - seen(*c) for c in visible) + sum(seen(*c) for c in hidden), "seven pairs, 1024 pixels each"
    )


@THEME.case(30, "across-the-near-plane", "a box that the near plane cuts", "its far side is seen through the cut", 0)
def _() -> Measured:
    inside = build.camera((0, 0, 3), clip_start=2.5, half=0.2)
    scene = build.make_scene(
        (build.box(), build.matte(emission=(0, 0, 0))), (build.floor(0.9, -0.99), build.emitter()), camera=inside
    )
    return Measured(largest(build.shoot(scene).radiance, 1))


@THEME.case(30, "clip-end-stops-camera-rays-only", "a mirror before the clip end shows a lamp beyond it", "the lamp", 0)
def _() -> Measured:
    lens = build.camera(clip_end=5.5)
    behind = {"visibility": Visibility(camera=False)}
    scene = build.make_scene(
        (build.floor(9), build.mirror()), (build.ceiling(9, 9), build.emitter(), behind), camera=lens
    )
    return Measured(largest(build.shoot(scene).radiance, 1))
