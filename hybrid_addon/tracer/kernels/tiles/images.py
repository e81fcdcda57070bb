# SPDX-License-Identifier: GPL-3.0-or-later
"""Of a tile: look-ups in images and in the world. Twins of materials/textures.py and emitters/world.py."""

# mypy: disable-error-code="no-untyped-def,no-untyped-call,assignment,operator,arg-type,call-arg"

from __future__ import annotations

import numpy as np
from numba import carray, types
from numba.extending import intrinsic

from ...emitters.prefilter import BLUR_ROUGHNESS
from .. import textures
from ..declare import clip, dot, helper, largest, stage
from ..elementary import SHORT

F, D = np.float32, np.float64
ONE, NONE, HALF, BYTE = F(1), F(0), F(0.5), F(1) / F(255)
OVER_2_PI, OVER_PI, LEAST_BRIGHT = F(0.5 / np.pi), F(1 / np.pi), F(1e-30)
REPEAT, EXTEND = textures.REPEAT, textures.EXTEND
LEAST_BLUR, BLUR_STEP = F(BLUR_ROUGHNESS[0]), F(BLUR_ROUGHNESS[1] - BLUR_ROUGHNESS[0])
LEVELS, MOST_LEVEL = len(BLUR_ROUGHNESS), F(len(BLUR_ROUGHNESS) - 1)
arctan2 = SHORT.arctan2
cell, wrapped, mixed = textures.cell, textures.wrapped, textures.mixed


@intrinsic
def _floats_at(typing, address):
    """An address as a pointer to float32."""

    def code(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], context.get_value_type(signature.return_type))

    return types.CPointer(types.float32)(types.uint64), code


@intrinsic
def _bytes_at(typing, address):
    """An address as a pointer to bytes."""

    def code(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], context.get_value_type(signature.return_type))

    return types.CPointer(types.uint8)(types.uint64), code


@helper
def _of_floats(texels, place, c):
    return texels[place, c] if place >= 0 else NONE


@helper
def _of_bytes(texels, curves, number, place, c):
    if place < 0:
        return NONE
    value = texels[place, c]
    return curves[number, value] if c < 3 else F(value) * BYTE


@stage
def look_up(images, numbers, u, v, result):
    """textures.lookup in images `numbers` (n,), none for -1, at u, v (n,): colours into result (3, n)."""
    one = u.dtype.type(1)
    half, nought = one * HALF, one * NONE
    for k in range(len(u)):
        number = numbers[k]
        if number < 0:
            continue
        height, width = images.layout[number, 1], images.layout[number, 2]
        along_u, along_v = images.layout[number, 3], images.layout[number, 4]
        i, ax = cell(u[k], u.dtype.type(width), half, nought)
        j, ay = cell(v[k], u.dtype.type(height), half, nought)
        left, right = wrapped(i, width, along_u), wrapped(i + 1, width, along_u)
        bottom, top = wrapped(j, height, along_v), wrapped(j + 1, height, along_v)
        p = bottom * width + left if bottom >= 0 and left >= 0 else -1
        q = bottom * width + right if bottom >= 0 and right >= 0 else -1
        r = top * width + left if top >= 0 and left >= 0 else -1
        s = top * width + right if top >= 0 and right >= 0 else -1
        if images.layout[number, 0] == 1:
            codes = carray(_bytes_at(images.address[number]), (height * width, 4))
            for c in range(3):
                result[c, k] = mixed(
                    _of_bytes(codes, images.curves, number, p, c), _of_bytes(codes, images.curves, number, q, c),
                    _of_bytes(codes, images.curves, number, r, c), _of_bytes(codes, images.curves, number, s, c), ax,
                    ay,
                )  # fmt: skip
        else:
            floats = carray(_floats_at(images.address[number]), (height * width, 4))
            for c in range(3):
                result[c, k] = mixed(
                    _of_floats(floats, p, c), _of_floats(floats, q, c), _of_floats(floats, r, c),
                    _of_floats(floats, s, c), ax, ay,
                )  # fmt: skip


@stage
def coordinates(direction, rotation):
    """textures.equirect_coordinates of directions (3, n) that are turned first (`Sky.turned`)."""
    n = direction.shape[1]
    u, v = np.empty(n, F), np.empty(n, F)
    for i in range(n):
        a, b, c = direction[0, i], direction[1, i], direction[2, i]
        x = rotation[0, 0] * a + rotation[0, 1] * b + rotation[0, 2] * c
        y = rotation[1, 0] * a + rotation[1, 1] * b + rotation[1, 2] * c
        z = rotation[2, 0] * a + rotation[2, 1] * b + rotation[2, 2] * c
        u[i] = HALF - arctan2(y, x) * OVER_2_PI
        v[i] = HALF + arctan2(z, np.sqrt(x * x + y * y)) * OVER_PI
    return u, v


@helper
def dimmed(x, y, z, limit):
    """By what vectors.no_brighter multiplies a colour."""
    brightest = largest(largest(x, y), z)
    return limit / largest(brightest, LEAST_BRIGHT) if brightest > limit else ONE


@stage
def limit_to(radiance, limit):
    """vectors.no_brighter, in place."""
    if not np.isfinite(limit):
        return
    for i in range(radiance.shape[1]):
        share = dimmed(radiance[0, i], radiance[1, i], radiance[2, i], limit)
        for c in range(3):
            radiance[c, i] = radiance[c, i] * share


@stage
def sky(world, images, which, direction):
    """environment.Sky.radiance in directions (3, n): of the sky that lights (0) or that cameras see (1)."""
    n = direction.shape[1]
    result = np.empty((3, n), F)
    if world.image[which] < 0:
        for c in range(3):
            result[c, :] = world.factor[which, c]
        return result
    u, v = coordinates(direction, world.rotation[which])
    look_up(images, np.full(n, world.image[which]), u, v, result)
    for c in range(3):
        for i in range(n):
            result[c, i] = world.factor[which, c] * result[c, i]
    limit_to(result, world.limit[which])
    return result


@stage
def glossy(world, images, direction, roughness):
    """CompiledWorld.glossy."""
    n = len(roughness)
    if world.image[0] < 0:
        return sky(world, images, 0, direction)
    result = np.zeros((3, n), F)
    u, v = coordinates(direction, world.rotation[0])
    height, width = world.blurred.shape[1], world.blurred.shape[2]
    wide, tall = F(width), F(height)
    for k in range(n):
        level = clip((roughness[k] - LEAST_BLUR) / BLUR_STEP, NONE, MOST_LEVEL)
        lower = min(np.int64(level), LEVELS - 2)
        t = F(level - F(lower))
        i, ax = cell(u[k], wide, HALF, NONE)
        j, ay = cell(v[k], tall, HALF, NONE)
        left, right = wrapped(i, width, REPEAT), wrapped(i + 1, width, REPEAT)
        bottom, top = wrapped(j, height, EXTEND), wrapped(j + 1, height, EXTEND)
        for c in range(3):
            total = NONE
            for step in range(2):
                image = world.blurred[lower + step]
                found = mixed(
                    image[bottom, left, c], image[bottom, right, c], image[top, left, c], image[top, right, c], ax, ay
                )
                total = total + (ONE - t if step == 0 else t) * found
            result[c, k] = total
    sharper = np.nonzero(roughness < LEAST_BLUR)[0]
    if len(sharper):
        some = np.empty((3, len(sharper)), F)
        for k in range(len(sharper)):
            i = sharper[k]
            x, y, z = direction[0, i], direction[1, i], direction[2, i]
            scale = ONE / np.sqrt(dot(x, y, z, x, y, z))
            some[0, k], some[1, k], some[2, k] = x * scale, y * scale, z * scale
        sharp = sky(world, images, 0, some)
        for k in range(len(sharper)):
            i = sharper[k]
            share = roughness[i] / LEAST_BLUR
            for c in range(3):
                result[c, i] = result[c, i] * share + sharp[c, k] * (ONE - share)
    return result
