# SPDX-License-Identifier: GPL-3.0-or-later
"""Panoramic cameras: from places in the frame to directions, and back, as Cycles maps them (in its
kernel/camera/projection.h).

Places are u, v (n,), from 0 at the left and lower edge of the mapping to 1. Directions (3, n) are in the camera's own
axes, x to the right, y up, looking along -z; NaN where it shows nothing, outside a fisheye's circle. All float64:
near a pole a degree is a hair's breadth.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ...procedural import elementary
from ...scene import Float64, Panorama

POLYNOMIAL_STEPS = 20
"""Newton's steps that invert a lens polynomial, as many as Cycles takes."""

ON_POLE = 1e-300
"""Added to lengths that are divided by, so that 0 / 0 is 0: on a fisheye's axis any direction around it is right."""


class Mapping(NamedTuple):
    """Both ways of one kind of panorama."""

    direction: Callable[[Panorama, Float64, Float64], Float64]
    place: Callable[[Panorama, Float64], tuple[Float64, Float64]]


def directions(panorama: Panorama, u: Float64, v: Float64) -> Float64:
    """Unit directions (3, n) float64 through places of the frame; NaN: none."""
    with np.errstate(all="ignore"):
        found = MAPPINGS[panorama.kind].direction(panorama, u, v)
        return np.asarray(found / np.sqrt(found[0] * found[0] + found[1] * found[1] + found[2] * found[2]))


def places(panorama: Panorama, direction: Float64) -> tuple[Float64, Float64]:
    """Places u, v (n,) of unit directions (3, n); outside 0..1 or NaN: the frame does not show them."""
    with np.errstate(all="ignore"):
        u, v = MAPPINGS[panorama.kind].place(panorama, direction)
        # A place that leads elsewhere is none: behind a mirror ball's back, beyond a circle's edge.
        back = directions(panorama, u, v)
        shown = (back * direction).sum(axis=0) > 0.5
    return np.where(shown, u, np.nan), np.where(shown, v, np.nan)


def _length(x: Float64, y: Float64) -> Float64:
    return np.sqrt(x * x + y * y)


def _between(bounds: tuple[float, float], share: Float64) -> Float64:
    return bounds[0] + (bounds[1] - bounds[0]) * share


def _share(bounds: tuple[float, float], value: Float64) -> Float64:
    return np.asarray((value - bounds[0]) / (bounds[1] - bounds[0]))


def _turned(bounds: tuple[float, float], longitude: Float64) -> Float64:
    """Longitudes by so many whole turns that they lie between two, where they can."""
    low = min(bounds)
    return low + np.mod(longitude - low, 2 * np.pi)


def _equirectangular(panorama: Panorama, u: Float64, v: Float64) -> Float64:
    longitude, latitude = _between(panorama.longitude, u), _between(panorama.latitude, v)
    around = elementary.cos(latitude)
    return np.stack([around * elementary.sin(longitude), elementary.sin(latitude), -around * elementary.cos(longitude)])


def _to_equirectangular(panorama: Panorama, d: Float64) -> tuple[Float64, Float64]:
    longitude = _turned(panorama.longitude, elementary.arctan2(d[0], -d[2]))
    return _share(panorama.longitude, longitude), _share(panorama.latitude, elementary.arcsin(np.clip(d[1], -1, 1)))


def _cylindrical(panorama: Panorama, u: Float64, v: Float64) -> Float64:
    longitude, height = _between(panorama.longitude, u), _between(panorama.height, v)
    return np.stack([elementary.sin(longitude), height / panorama.radius, -elementary.cos(longitude)])


def _to_cylindrical(panorama: Panorama, d: Float64) -> tuple[Float64, Float64]:
    longitude = _turned(panorama.longitude, elementary.arctan2(d[0], -d[2]))
    height = panorama.radius * d[1] / _length(d[0], d[2])
    return _share(panorama.longitude, longitude), _share(panorama.height, height)


def _cube_face(panorama: Panorama, u: Float64, v: Float64) -> Float64:
    return np.stack(
        [elementary.tan((u - 0.5) * (np.pi / 2)), elementary.tan((v - 0.5) * (np.pi / 2)), np.full_like(u, -1.0)]
    )


def _to_cube_face(panorama: Panorama, d: Float64) -> tuple[Float64, Float64]:
    ahead = np.where(d[2] < 0, -d[2], np.nan)
    return 0.5 + elementary.arctan(d[0] / ahead) / (np.pi / 2), 0.5 + elementary.arctan(d[1] / ahead) / (np.pi / 2)


def _mirror_ball(panorama: Panorama, u: Float64, v: Float64) -> Float64:
    """What a ball of chrome shows that is seen from far away: the view axis, mirrored at its normals."""
    x, y = 2 * u - 1, 2 * v - 1
    z = np.sqrt(1 - x * x - y * y)  # NaN beside the ball
    return np.stack([2 * z * x, 2 * z * y, 1 - 2 * z * z])


def _to_mirror_ball(panorama: Panorama, d: Float64) -> tuple[Float64, Float64]:
    z = np.sqrt((1 - d[2]) / 2)
    return 0.5 + d[0] / (4 * z), 0.5 + d[1] / (4 * z)


def _off_axis(angle: Float64, x: Float64, y: Float64) -> Float64:
    """Directions (3, n) at angles (n,) from the view axis, to the side of x, y (n,)."""
    radius = _length(x, y) + ON_POLE
    return np.stack([x / radius * elementary.sin(angle), y / radius * elementary.sin(angle), -elementary.cos(angle)])


def _around(radius: Float64, d: Float64) -> tuple[Float64, Float64]:
    """The inverse: x, y (n,) at so many units from the axis."""
    side = _length(d[0], d[1]) + ON_POLE
    return radius * d[0] / side, radius * d[1] / side


def _angle(d: Float64) -> Float64:
    return elementary.arctan2(_length(d[0], d[1]), -d[2])


def _equidistant(panorama: Panorama, u: Float64, v: Float64) -> Float64:
    x, y = 2 * u - 1, 2 * v - 1
    radius = _length(x, y)
    return _off_axis(np.where(radius <= 1, radius * panorama.field_of_view / 2, np.nan), x, y)


def _to_equidistant(panorama: Panorama, d: Float64) -> tuple[Float64, Float64]:
    x, y = _around(_angle(d) / (panorama.field_of_view / 2), d)
    return (x + 1) / 2, (y + 1) / 2


def _on_sensor(panorama: Panorama, u: Float64, v: Float64) -> tuple[Float64, Float64, Float64]:
    """Millimetres x, y and from the sensor's middle."""
    x, y = (u - 0.5) * panorama.sensor[0], (v - 0.5) * panorama.sensor[1]
    return x, y, _length(x, y)


def _from_sensor(panorama: Panorama, radius: Float64, d: Float64) -> tuple[Float64, Float64]:
    x, y = _around(radius, d)
    return x / panorama.sensor[0] + 0.5, y / panorama.sensor[1] + 0.5


def _equisolid(panorama: Panorama, u: Float64, v: Float64) -> Float64:
    x, y, radius = _on_sensor(panorama, u, v)
    shown = radius <= 2 * panorama.lens * elementary.sin(panorama.field_of_view / 4)
    return _off_axis(np.where(shown, 2 * elementary.arcsin(radius / (2 * panorama.lens)), np.nan), x, y)


def _to_equisolid(panorama: Panorama, d: Float64) -> tuple[Float64, Float64]:
    return _from_sensor(panorama, 2 * panorama.lens * elementary.sin(_angle(d) / 2), d)


def _polynomial(panorama: Panorama, u: Float64, v: Float64) -> Float64:
    x, y, radius = _on_sensor(panorama, u, v)
    angle = -np.polynomial.polynomial.polyval(radius, panorama.polynomial)
    return _off_axis(np.where(np.abs(angle) <= panorama.field_of_view / 2, angle, np.nan), x, y)


def _to_polynomial(panorama: Panorama, d: Float64) -> tuple[Float64, Float64]:
    of, slope = np.array(panorama.polynomial), np.polynomial.polynomial.polyder(panorama.polynomial)
    wanted = -_angle(d)
    radius = (wanted - of[0]) / of[1]
    for _ in range(POLYNOMIAL_STEPS):
        value, steep = (np.polynomial.polynomial.polyval(radius, c) for c in (of, slope))
        radius = radius + (wanted - value) / steep
    return _from_sensor(panorama, radius, d)


MAPPINGS = {
    "EQUIRECTANGULAR": Mapping(_equirectangular, _to_equirectangular),
    "EQUIANGULAR_CUBEMAP_FACE": Mapping(_cube_face, _to_cube_face),
    "MIRRORBALL": Mapping(_mirror_ball, _to_mirror_ball),
    "FISHEYE_EQUIDISTANT": Mapping(_equidistant, _to_equidistant),
    "FISHEYE_EQUISOLID": Mapping(_equisolid, _to_equisolid),
    "FISHEYE_LENS_POLYNOMIAL": Mapping(_polynomial, _to_polynomial),
    "CENTRAL_CYLINDRICAL": Mapping(_cylindrical, _to_cylindrical),
}
"""By Blender's names of them."""
