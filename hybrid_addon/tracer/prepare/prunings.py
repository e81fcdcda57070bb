# SPDX-License-Identifier: GPL-3.0-or-later
"""Every pruning that saves measurable time or memory: what it leaves out, and whether the picture can tell.

`tools/prunings.py` measures what each saves. What else a scene does not need costs nothing to leave out, and is no
pruning: the plan lists it among what it skips.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Pruning:
    """Something that can be left out.

    name : in the report.   leaves_out, when : as text.
    kind : "exact" always changes no bit; "exact if": no bit, under the condition that `when` states and the plan
           proves; "bounded": the error is at most the residual; "heuristic": an audit estimates it.
    unit : what is counted of what it saved, "" where nothing is.
    """

    name: str
    kind: Literal["exact", "exact if", "bounded", "heuristic"]
    leaves_out: str
    when: str
    unit: str = ""


PRUNINGS = (
    Pruning("empty-mask", "exact", "tracing, and preparing the scene", "the mask is 0 everywhere", "pixels"),
    Pruning(
        "unmasked", "exact if", "pixels", "the mask is 0 there: it covers all that the pixel filter spreads", "pixels"
    ),
    Pruning(
        "unchanged",
        "exact if",
        "preparing meshes, and building search trees",
        "the last frame had the same, byte for byte",
        "triangles",
    ),
    Pruning(
        "weightless",
        "exact",
        "single reflected and refracted rays",
        "they contribute nothing: R or T is 0 there",
        "rays",
    ),
    Pruning("secondary", "exact if", "the search tree for reflected and refracted rays", "there are no such rays"),
    Pruning(
        "unlit", "exact", "single shadow rays", "no light would arrive: it is behind, out of range or cone", "rays"
    ),
    Pruning("any-hit", "exact if", "the nearest hit along shadow rays", "nothing is hit, or all is opaque", "rays"),
    Pruning("absorption", "exact if", "absorption on the way of rays", "no closed body absorbs"),
    Pruning(
        "cutoff",
        "bounded",
        "rays that contribute little",
        "Min Light is above 0: no sample loses more than that",
        "rays",
    ),
    Pruning(
        "faint-light",
        "bounded",
        "light that contributes little",
        "Min Light is above 0: light is a small part of it",
        "rays",
    ),
    Pruning(
        "adaptive",
        "heuristic",
        "samples",
        "Adaptive is above 0: the pixel's first samples and neighbours agree",
        "samples",
    ),
)
"""All prunings, in the order in which a frame meets them. docs/reference/errors-and-plan.md has them."""

BY_NAME = {pruning.name: pruning for pruning in PRUNINGS}
