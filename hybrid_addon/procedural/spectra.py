# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours of light by its temperature or its wavelength, as the nodes Blackbody and Wavelength give them.

Linear Rec.709; `matrix` (3, 3) takes that to the file's working space.
"""

from __future__ import annotations

import numpy as np

from .hashes import Array

COLDEST, HOTTEST = 800.0, 12000.0
"""Kelvin: EEVEE's table ends there."""

WARMTH = (965.0, 1167.0, 1449.0, 1902.0, 3315.0, 6365.0)
"""Kelvin at which the next row of BLACKBODY begins."""

BLACKBODY = np.array(
    """
    1.61919106e03 -2.05010916e-03 5.02995757e00 -4.88999748e02 6.04330754e-04 -7.55807526e-02
    5.96945309e-11 -4.85742887e-08 -9.70622247e-05 -4.07936148e-03
    2.48845471e03 -1.11330907e-03 3.22621544e00 -7.55994277e02 3.16730098e-04 4.78306139e-01
    2.40430366e-11 5.55021075e-08 -1.98503712e-04 2.89312858e-02
    3.34143193e03 -4.86551192e-04 1.76486769e00 -1.02363977e03 1.20223470e-04 9.36662319e-01
    -1.40949732e-11 1.89878968e-07 -3.56632824e-04 9.10767778e-02
    4.09461742e03 -1.27446582e-04 7.25731635e-01 -1.26571316e03 4.87340896e-06 1.27054498e00
    -3.61460868e-11 2.84822009e-07 -4.93211319e-04 1.56723440e-01
    4.67028036e03 2.91258199e-05 1.26703442e-01 -1.42529332e03 -4.01150431e-05 1.43972784e00
    -1.97075738e-11 1.75359352e-07 -2.50542825e-04 -2.22783266e-02
    4.59509185e03 2.87495649e-05 1.50345020e-01 -1.17554822e03 -2.16378048e-05 1.30408023e00
    -1.61997957e-13 -1.64216008e-08 3.86216271e-04 -7.38077418e-01
    3.78717450e03 9.35907826e-06 3.99075871e-01 -5.00799571e02 -4.59832026e-06 1.09098763e00
    6.72650283e-13 -2.73078809e-08 4.24098264e-04 -7.52335691e-01
    """.split(),
    np.float64,
).reshape(-1, 10)
"""Fits of Planck's law at luminance 1: red and green are a / T + b T + c, blue is a cubic in T. From Cycles
(util/math: svm_math_blackbody_color), as EEVEE's own."""

FIRST, STEP = 380.0, 5.0
"""Nanometres of the first row of OBSERVER, and between two rows."""

OBSERVER = np.array(
    """
    14 0 65 22 1 105 42 1 201 76 2 362 143 4 679 232 6 1102 435 12 2074 776 22 3713 1344 40 6456 2148 73 10391
    2839 116 13856 3285 168 16230 3483 230 17471 3481 298 17826 3362 380 17721 3187 480 17441 2908 600 16692
    2511 739 15281 1954 910 12876 1421 1126 10419 956 1390 8130 580 1693 6162 320 2080 4652 147 2586 3533
    49 3230 2720 24 4073 2123 93 5030 1582 291 6082 1117 633 7100 782 1096 7932 573 1655 8620 422 2257 9149 298
    2904 9540 203 3597 9803 134 4334 9950 87 5121 10000 57 5945 9950 39 6784 9786 27 7621 9520 21 8425 9154 18
    9163 8700 17 9786 8163 14 10263 7570 11 10567 6949 10 10622 6310 8 10456 5668 6 10026 5030 3 9384 4412 2
    8544 3810 2 7514 3210 1 6424 2650 0 5419 2170 0 4479 1750 0 3608 1382 0 2835 1070 0 2187 816 0 1649 610 0
    1212 446 0 874 320 0 636 232 0 468 170 0 329 119 0 227 82 0 158 57 0 114 41 0 81 29 0 58 21 0 41 15 0 29 10 0
    20 7 0 14 5 0 10 4 0 7 2 0 5 2 0 3 1 0 2 1 0 2 1 0 1 0 0 1 0 0 1 0 0 0 0 0
    """.split(),
    np.float64,
).reshape(-1, 3) / 10000  # fmt: skip
"""Colour matching functions x, y, z of the CIE 1931 standard observer."""

XYZ_TO_REC709 = np.array(
    [[3.2404542, -1.5371385, -0.4985314], [-0.9692660, 1.8760108, 0.0415560], [0.0556434, -0.2040259, 1.0572252]]
)
BRIGHTEST = 2.52
"""What a wavelength's colour is divided by, so that none is much brighter than 1 (Cycles, svm/wavelength.h)."""


WORKING = {
    "Linear Rec.2020": [0.627404, 0.329283, 0.043313, 0.069097, 0.919540, 0.011362, 0.016391, 0.088013, 0.895595],
    "ACEScg": [0.613097, 0.339523, 0.047379, 0.070194, 0.916354, 0.013452, 0.020616, 0.109570, 0.869815],
}
"""From linear Rec.709 to other spaces that a file may work in."""


def working_space(name: str) -> Array:
    """(3, 3) from linear Rec.709 to a file's working space, as Blender names it."""
    return np.array(WORKING.get(name, np.eye(3))).reshape(3, 3)


def blackbody(temperature: Array, matrix: Array) -> Array:
    """(3, n) of light as a body in this heat, Kelvin (1, n), sends it; luminance 1."""
    t = np.clip(temperature[0].astype(np.float64), COLDEST, HOTTEST)
    r, g, b = np.split(BLACKBODY.take(np.searchsorted(WARMTH, t, side="right"), axis=0).T, (3, 6))
    found = [a / t + slope * t + c for a, slope, c in (r, g)]
    found.append(((b[0] * t + b[1]) * t + b[2]) * t + b[3])
    return np.asarray(matrix @ np.stack(found), temperature.dtype)


def wavelength(nanometres: Array, matrix: Array) -> Array:
    """(3, n) of light of one wavelength, (1, n); what no screen shows is cut at 0."""
    xyz = observer(nanometres[0].astype(np.float64))
    return np.asarray(np.maximum(matrix @ XYZ_TO_REC709 @ xyz / BRIGHTEST, 0), nanometres.dtype)


def observer(nanometres: Array) -> Array:
    """(3, n): the CIE 1931 standard observer's x, y, z at wavelengths (n,); 0 of what nobody sees."""
    x, steps = (nanometres - FIRST) / STEP, np.arange(len(OBSERVER))
    return np.stack([np.interp(x, steps, row, left=0.0, right=0.0) for row in OBSERVER.T])
