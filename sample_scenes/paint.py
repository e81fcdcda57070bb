# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures made with numpy: everything that the sample scenes use as a texture is painted here.

Each function returns an (height, width, 3) float array of sRGB values in 0..1, row 0 at the bottom.
"""

from __future__ import annotations

import numpy as np


def _hash(ix, iy, iz, seed):
    """A repeatable number in 0..1 for each lattice point (integers, so the same on every machine)."""
    h = (ix * 374761393 + iy * 668265263 + iz * 2147483647 + seed * 1274126177).astype(np.int64) & 0xFFFFFFFF
    h = ((h ^ (h >> 13)) * 1274126177) & 0xFFFFFFFF
    return ((h ^ (h >> 16)) & 0xFFFF) / 65535.0


def noise(p, seed=0):
    """Smooth value noise in 0..1 at the points p (..., 3)."""
    cell = np.floor(p).astype(np.int64)
    f = p - cell
    f = f * f * (3 - 2 * f)
    total = np.zeros(p.shape[:-1])
    for dx in (0, 1):
        for dy in (0, 1):
            for dz in (0, 1):
                w = np.where(dx, f[..., 0], 1 - f[..., 0])
                w = w * np.where(dy, f[..., 1], 1 - f[..., 1]) * np.where(dz, f[..., 2], 1 - f[..., 2])
                total += w * _hash(cell[..., 0] + dx, cell[..., 1] + dy, cell[..., 2] + dz, seed)
    return total


def fractal(p, octaves=5, seed=0):
    """Several octaves of noise, in 0..1."""
    total, weight = np.zeros(p.shape[:-1]), 0.0
    for k in range(octaves):
        total += noise(p * 2.0**k, seed + k) * 0.5**k
        weight += 0.5**k
    return total / weight


def smoothstep(low, high, x):
    """0 below low, 1 above high, smooth between."""
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def blend(a, b, t):
    """Mix of two colours (or colour arrays) by t (...)."""
    t = np.asarray(t)[..., None]
    return np.asarray(a) * (1 - t) + np.asarray(b) * t


def _directions(width, height):
    """World direction of each pixel of an equirectangular picture, as Blender lays it out."""
    azimuth = (0.5 - (np.arange(width) + 0.5) / width) * 2 * np.pi
    elevation = ((np.arange(height) + 0.5) / height - 0.5) * np.pi
    c = np.cos(elevation)[:, None]
    xyz = np.stack(np.broadcast_arrays(c * np.cos(azimuth), c * np.sin(azimuth), np.sin(elevation)[:, None]), axis=-1)
    return xyz, azimuth[None, :], elevation[:, None]


def _sky(xyz, zenith, middle, horizon, glow, glow_from):
    """A clear evening sky, brightest over the horizon in the direction `glow_from`."""
    up = np.abs(xyz[..., 2])
    colour = blend(horizon, middle, smoothstep(0.0, 0.28, up))
    colour = blend(colour, zenith, smoothstep(0.2, 0.95, up))
    towards = np.clip(xyz @ np.asarray(glow_from), 0, 1) ** 3
    return blend(colour, glow, 0.85 * towards * (1 - smoothstep(0.0, 0.55, up)))


def lake(width=2048, height=1024):
    """Evening over a lake with hills all round: the world of the three outdoor scenes."""
    xyz, azimuth, elevation = _directions(width, height)
    below = -xyz[..., 2]
    waves = np.stack([azimuth * 9 + 0 * below, 1.2 / (0.01 + np.abs(below)), 0 * below], axis=-1)
    swell = np.where(below > 0, (fractal(waves, 3, seed=40) - 0.45) * (0.02 + 0.25 * np.abs(below)), 0)
    mirrored = np.stack([xyz[..., 0], xyz[..., 1], np.abs(np.abs(below) + swell)], axis=-1)
    glow_from = np.array([0.55, 0.83, 0.08])
    colour = _sky(mirrored, (0.24, 0.42, 0.70), (0.55, 0.71, 0.88), (0.93, 0.86, 0.80), (1.0, 0.82, 0.62), glow_from)
    flat = mirrored / (mirrored[..., 2:] + 0.22)  # cloud layer: seen at a slant towards the horizon
    cover = fractal(flat * [1.5, 1.5, 0.0] + [3.1, 7.7, 0.5], 5, seed=3)
    clouds = smoothstep(0.53, 0.74, cover) * smoothstep(0.02, 0.16, mirrored[..., 2])
    colour = blend(colour, (1.0, 0.96, 0.92), 0.8 * clouds)
    tall = np.where(elevation < 0, np.arcsin(np.clip(mirrored[..., 2], 0, 1)), np.abs(elevation))
    for k, (top, rough, tint) in enumerate(
        [(0.115, 0.055, (0.60, 0.66, 0.78)), (0.075, 0.045, (0.40, 0.48, 0.60)), (0.038, 0.03, (0.27, 0.36, 0.36))]
    ):
        ring = np.stack([np.cos(azimuth), np.sin(azimuth), np.full_like(azimuth, 0.37 * k)], axis=-1) * (2.3 + 1.1 * k)
        ridge = top + rough * 2 * (fractal(ring, 5, seed=20 + k) - 0.5)
        lit = blend(tint, (1.0, 0.80, 0.62), 0.35 * np.clip(xyz @ glow_from, 0, 1) ** 3)
        colour = blend(colour, lit, smoothstep(-0.003, 0.003, ridge - tall))
    deep = smoothstep(-0.05, 0.6, below)
    water = blend(colour * 0.82, (0.10, 0.18, 0.24), 0.2 + 0.7 * deep)
    shore = smoothstep(0.0, 0.004, below)
    return np.clip(blend(colour, water, shore), 0, 1)


def above_the_clouds(width=1024, height=512):
    """Cruising height: deep sky over a sea of clouds; the world of the bathroom."""
    xyz, _, _ = _directions(width, height)
    sky = _sky(xyz, (0.10, 0.25, 0.58), (0.33, 0.56, 0.86), (0.86, 0.90, 0.95), (1.0, 0.92, 0.80), [1.0, 0.1, 0.05])
    flat = xyz / (np.abs(xyz[..., 2:]) + 0.10)
    puffs = fractal(flat * [1.9, 1.9, 0.0] + [5.5, 1.2, 0.0], 6, seed=9)
    deck = blend((0.50, 0.60, 0.76), (1.0, 0.99, 0.97), smoothstep(0.34, 0.66, puffs))
    deck = blend(deck, (0.88, 0.91, 0.96), smoothstep(0.22, 0.0, -xyz[..., 2]))
    return np.clip(blend(sky, deck, smoothstep(0.0, 0.03, -xyz[..., 2])), 0, 1)


def _grid(width, height):
    """The (u, v) of each pixel, in 0..1."""
    u = (np.arange(width) + 0.5) / width
    v = (np.arange(height) + 0.5) / height
    return np.meshgrid(u, v)


def _veins(u, v, scale, seed):
    """Marble veins, in 0..1; wraps in neither direction."""
    p = np.stack([u * scale, v * scale, np.zeros_like(u)], axis=-1)
    warped = fractal(p, 4, seed) + 0.5 * fractal(p * 2.7 + 9.3, 3, seed + 5)
    return np.exp(-((np.abs(np.sin(warped * 9.0)) / 0.16) ** 2)) * fractal(p * 0.8 + 4.1, 3, seed + 11)


def marble(size=512, base=(0.93, 0.92, 0.90), vein=(0.52, 0.52, 0.55), scale=3.0, seed=1):
    """One slab of marble."""
    u, v = _grid(size, size)
    clouds = fractal(np.stack([u * scale * 2, v * scale * 2, 0 * u], axis=-1), 4, seed + 30)
    return np.clip(blend(base, vein, 0.8 * _veins(u, v, scale, seed)) - 0.07 * (clouds - 0.4)[..., None], 0, 1)


def chequer(size=768, tiles=12, light=(0.88, 0.84, 0.77), dark=(0.20, 0.26, 0.30)):
    """A chequered floor of polished stone, each tile with a tone of its own, thin joints between."""
    u, v = _grid(size, size)
    i, j = np.floor(u * tiles).astype(np.int64), np.floor(v * tiles).astype(np.int64)
    odd = ((i + j) % 2).astype(bool)
    shift = _hash(i, j, 0 * i, 77) * 13.0
    veins = _veins(u + shift, v - shift, 9.0, 5)
    pale = blend(light, (0.66, 0.58, 0.50), 0.6 * veins)
    deep = blend(dark, (0.55, 0.60, 0.62), 0.6 * veins)
    tone = 1 + 0.10 * (_hash(i, j, 0 * i, 12) - 0.5)
    colour = np.where(odd[..., None], deep, pale) * tone[..., None]
    edge = np.minimum(np.minimum(u * tiles % 1, 1 - u * tiles % 1), np.minimum(v * tiles % 1, 1 - v * tiles % 1))
    return np.clip(blend((0.42, 0.40, 0.37), colour, smoothstep(0.006, 0.022, edge)), 0, 1)


def wood(width=512, height=512, planks=1, light=(0.50, 0.33, 0.20), dark=(0.27, 0.15, 0.085), seed=4):
    """Boards that run along v, side by side in u."""
    u, v = _grid(width, height)
    board = np.floor(u * planks).astype(np.int64)
    shift = _hash(board, 0 * board, 0 * board, seed) * 17.0
    along = v * 1.1 + shift
    across = u * 6.0 / max(planks / 3.0, 1.0) * (planks / 3.0 if planks > 3 else 1.0)
    warp = fractal(np.stack([across, along * 0.9, shift], axis=-1), 4, seed)
    rings = 0.5 + 0.5 * np.sin((warp * 7 + across * 1.3) * 5.5)
    fibre = fractal(np.stack([u * 120, along * 5, shift], axis=-1), 3, seed + 2)
    tone = 0.88 + 0.24 * _hash(board, 1 + 0 * board, 0 * board, seed)
    colour = blend(light, dark, np.clip(0.65 * rings + 0.55 * (fibre - 0.35), 0, 1)) * tone[..., None]
    if planks > 1:
        edge = np.minimum(u * planks % 1, 1 - u * planks % 1)
        ends = (v * 2 + _hash(board, 2 + 0 * board, 0 * board, seed)) % 1
        joint = np.minimum(smoothstep(0.0, 0.03, edge), smoothstep(0.0, 0.006, np.minimum(ends, 1 - ends)))
        colour = colour * (0.35 + 0.65 * joint)[..., None]
    return np.clip(colour, 0, 1)


def globe(width=768, height=384):
    """Bands and a graticule in blue and gold: the skin of the reflective sphere."""
    u, v = _grid(width, height)
    lon, lat = u * 2 * np.pi, (v - 0.5) * np.pi
    p = np.stack([np.cos(lon) * np.cos(lat), np.sin(lon) * np.cos(lat), np.sin(lat)], axis=-1)
    land = smoothstep(0.50, 0.54, fractal(p * 1.9 + 5.2, 5, seed=60))
    sea = blend((0.05, 0.17, 0.36), (0.10, 0.36, 0.55), fractal(p * 3 + 1.0, 4, seed=61))
    colour = blend(sea, (0.87, 0.70, 0.36), land)
    line = np.maximum(np.cos(lon * 12) ** 2, 0) > 0.992
    line |= np.cos(lat * 12) ** 2 > 0.992
    return np.clip(blend(colour, (0.95, 0.90, 0.78), 0.7 * line), 0, 1)


def ball(width=768, height=384, sectors=8):
    """A beach ball's sectors with dotted seams: the skin of the half transparent sphere."""
    u, v = _grid(width, height)
    palette = np.array([(0.90, 0.25, 0.16), (0.97, 0.90, 0.78), (0.95, 0.62, 0.13), (0.10, 0.47, 0.52)])
    index = np.floor((u + 0.04 * np.sin(v * 2 * np.pi)) * sectors).astype(int) % 4
    colour = palette[index]
    cap = smoothstep(0.435, 0.44, np.abs(v - 0.5))
    colour = blend(colour, (0.97, 0.90, 0.78), cap)
    belt = smoothstep(0.036, 0.032, np.abs(v - 0.5))
    return np.clip(blend(colour, (0.13, 0.12, 0.16), belt), 0, 1)


def weave(size=256, light=(0.93, 0.90, 0.85), dark=(0.62, 0.57, 0.50)):
    """Terry cloth with three darker bands near one end (v close to 0)."""
    u, v = _grid(size, size)
    loops = fractal(np.stack([u * 60, v * 60, 0 * u], axis=-1), 2, seed=90)
    colour = blend(light, dark, 0.35 * loops)
    for centre in (0.08, 0.12, 0.16):
        colour = blend(colour, (0.22, 0.36, 0.42), smoothstep(0.014, 0.009, np.abs(v - centre)))
    return np.clip(colour, 0, 1)
