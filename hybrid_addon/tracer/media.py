"""Which medium lies on either side of a hit: the one place that decides the relative index of refraction.

For now a surface bounds its own medium against air: coming from outside eta = ior, from inside 1 / ior. The next step,
nested dielectrics (Schmidt & Budge 2002), gives every ray a stack of the surfaces it is inside of; `relative_ior` will
then read its two sides from that stack, and whoever spawns a transmitted ray will push or pop.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scene import Float64


def relative_ior(ior: Float64, entering: NDArray[np.bool_]) -> Float64:
    """eta (n,), transmitted over incident, for surfaces of index `ior` (n,) inside over outside."""
    return np.where(entering, ior, 1 / ior)
