# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects need rays, why, and what rays would cost: a survey in words."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:  # the interface needs this module's words where Embree does not load
    from ..tracer.integrator.survey import Survey

LEAST_SHARE = 0.02
"""An object is worth rays if this share of its light comes in ways that EEVEE cannot follow."""

MOST_OF_IT = 0.9
"""Where the materials that need rays have no more than this share of an object's rays, they are suggested alone."""

REASONS = {
    "OFF_SCREEN": "mirrors what the picture does not show",
    "UNSEEN": "mirrors glass or blended materials, which EEVEE leaves out of reflections",
    "MIRRORS": "mirrors other mirrors",
    "BEHIND": "has glass behind its glass, which EEVEE leaves out",
    "REFRACTED": "refracts light more than once",
}


def advice(
    survey: Survey,
    owners: Sequence[str],
    ray_traced: set[str],
    *,
    pixels: int,
    samples: int,
    threads: int,
    surfaces: Sequence[str] = (),
    materials: Collection[str] = (),
) -> list[dict[str, Any]]:
    """What is known of each object that the survey met or that is ray traced; those that matter most first.

    owners  : of each of the survey's objects the one to flag.   ray traced : those that are.
    pixels, samples, threads : of the render whose cost is estimated, by the rays of each object alone; `shared_out`
    makes it what a rehearsal took.
    surfaces : names of the scene's.   materials : those that are ray traced by themselves.

    Each: object, materials (those of it that need rays, where the rest does not; else none: all of it), coverage (share
    of the picture), needs (share of its light that EEVEE cannot follow), why (one short sentence each, the most
    important first), suggested, ray_traced, rough (it would be suggested if rays followed rough surfaces), rays and
    seconds (an estimate, without building).
    """
    from ..tracer.integrator.survey import KINDS

    names = list(dict.fromkeys(owners))
    number = np.array([names.index(owner) for owner in owners], np.intp)

    def of(values: np.ndarray) -> np.ndarray:
        return np.bincount(number, values, minlength=len(names))

    shown = of(survey.pixels)
    lit = np.where(shown > 0, shown, 1)
    needs, if_rough = of(survey.pixels * survey.needs) / lit, of(survey.pixels * survey.if_rough) / lit
    shares = [of(survey.pixels * share) / lit for share in survey.shares]
    rays = of(survey.rays) / survey.all_pixels * pixels * samples
    parts = _parts(survey, number, of(survey.rays), surfaces) if surfaces else {}
    shown_traced = _wearers(survey, number, surfaces, materials)
    each = survey.seconds_per_ray / threads
    found = [
        {
            "object": name,
            "materials": parts.get(i, ([], 1.0))[0],
            "coverage": float(shown[i] / survey.all_pixels),
            "needs": float(needs[i]),
            "why": _why({kind: float(share[i]) for kind, share in zip(KINDS, shares, strict=True)}),
            "suggested": bool(needs[i] >= LEAST_SHARE),
            "ray_traced": name in ray_traced or i in shown_traced,
            "rough": bool(if_rough[i] >= LEAST_SHARE > needs[i]),
            "rays": round(float(rays[i] * parts.get(i, ([], 1.0))[1])),
            "seconds": float(rays[i] * each * parts.get(i, ([], 1.0))[1]),
        }
        for i, name in enumerate(names)
        if rays[i] > 0 or name in ray_traced
    ]
    return sorted(found, key=lambda entry: (-entry["coverage"] * entry["needs"], -entry["coverage"], entry["object"]))


def _parts(
    survey: Survey, number: NDArray[np.intp], rays: np.ndarray, surfaces: Sequence[str]
) -> dict[int, tuple[list[str], float]]:
    """Of objects of which only some materials need rays: the names of these, and their share of the object's rays.

    number : of each of the survey's objects the one that is flagged.   rays : of each of those.
    """
    worn, found = survey.worn, dict[int, tuple[list[str], float]]()
    owner, name = number[worn.object], np.array([surfaces[i] for i in worn.surface], object)
    needy = worn.needs >= LEAST_SHARE
    for i in np.unique(owner[needy]).tolist():
        mine = owner == i
        chosen = mine & np.isin(name, name[mine & needy])
        share = float(worn.rays[chosen].sum() / max(rays[i], 1.0))
        names = sorted({str(n) for n in name[chosen]})
        if share <= MOST_OF_IT and all(names) and not chosen[mine].all():
            found[i] = names, share
    return found


def _wearers(survey: Survey, number: NDArray[np.intp], surfaces: Sequence[str], materials: Collection[str]) -> set[int]:
    """The objects that show one of these materials."""
    worn = survey.worn
    return {
        int(number[o]) for o, s in zip(worn.object, worn.surface, strict=True) if surfaces and surfaces[s] in materials
    }


def shared_out(entries: Sequence[dict[str, Any]], seconds: float) -> list[dict[str, Any]]:
    """The same, so that those that are worth rays take so many seconds together, each by its rays."""
    rays = sum(entry["rays"] for entry in entries if is_worth(entry))
    return [{**entry, "seconds": seconds * entry["rays"] / max(rays, 1)} for entry in entries]


def is_worth(entry: dict[str, Any]) -> bool:
    """Whether an object belongs on the list: it needs rays, or has them."""
    return bool(entry["suggested"] or entry["ray_traced"])


def rough_note(entries: Sequence[dict[str, Any]]) -> str:
    """One line on the objects that are not on the list for their roughness alone; "" if there are none."""
    number = sum(entry["rough"] and not is_worth(entry) for entry in entries)
    if number == 0:
        return ""
    if number == 1:
        return "1 object is rough: set Rough Samples to 1 or more to see what rays bring"
    return f"{number} objects are rough: set Rough Samples to 1 or more to see what rays bring"


def _why(shares: dict[str, float]) -> list[str]:
    order = sorted(shares, key=lambda kind: -shares[kind])
    told = [f"{REASONS[kind]} ({shares[kind] * 100:.0f} % of its light)" for kind in order if shares[kind] >= 0.005]
    return told or ["nothing that EEVEE cannot draw"]


def sentence(entry: dict[str, Any]) -> str:
    """One line: what, how much of the picture, why, and the cost."""
    named = f" ({', '.join(entry['materials'])} only)" if entry["materials"] else ""
    what = f"{entry['object']}{named}: {entry['coverage'] * 100:.1f} % of the picture; {', '.join(entry['why'])}"
    return f"{what}; {cost(entry)}"


def cost(entry: dict[str, Any]) -> str:
    """The estimate as people read it."""
    return f"about {entry['seconds']:.2g} s" if entry["seconds"] < 100 else f"about {entry['seconds'] / 60:.0f} min"
