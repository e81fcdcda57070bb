# SPDX-License-Identifier: GPL-3.0-or-later
"""Procedural textures: Blender's texture nodes that are formulas, worked out for many points at once.

Pure numpy, float32 throughout: as on the graphics card, the integer part of a coordinate decides which cell it is in,
and hashes of integers are equal bit by bit. The formulas are those of the nodes' GLSL in Blender; the papers behind
them are named in each file.

    hashes.py     Jenkins' lookup3 and PCG
    noise.py      Noise Texture
    voronoi.py    Voronoi Texture, one octave;  cells.py  its octaves and outputs
    gabor.py      Gabor Texture
    patterns.py   Checker, Gradient, Wave, Magic, Brick, White Noise
    coordinates.py colors.py    mapping and projections; hue and blend types
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numpy.typing import NDArray

from .cells import voronoi_rows
from .gabor import gabor_rows
from .noise import noise_color, noise_factor
from .patterns import (
    brick,
    brick_factor,
    checker,
    checker_factor,
    gradient,
    magic,
    wave,
    white_noise,
    white_noise_color,
)

Array = NDArray[Any]

TEXTURES: dict[str, Callable[..., Array]] = {
    "noise": noise_factor,
    "noise_color": noise_color,
    "voronoi": voronoi_rows,
    "gabor": gabor_rows,
    "wave": wave,
    "magic": magic,
    "brick": brick,
    "brick_factor": brick_factor,
    "checker": checker,
    "checker_factor": checker_factor,
    "gradient": gradient,
    "white_noise": white_noise,
    "white_noise_color": white_noise_color,
}
"""Operations on (1 or 3, n) arrays, as all of `expressions`; the last argument is the node's fixed settings."""
