# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces compiled to a structure of arrays, one column a surface, with the weights of the surface model worked out.

L = r Lr + (1 - r) [ o Llocal + (1 - o) (F Lr + (1 - F) Lt) ] + Le      (see scene.Surface)

The weights are products of float64 scalars, rounded once; hits gather them with `take`. Surfaces that vary or have
layers stand here with what they may do; their hits get columns of their own (see `varying`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...expressions import ATTRIBUTE_WIDTHS, expressions_of, reads
from ...scene import BLACK, WHITE, Expression, Float32, Float64, Plane, Scene, Sphere, Surface
from ..core.constants import FAINT, MIRROR_ROUGHNESS, TRACED_ROUGHNESS
from .columns import NOT_CROSSED, Columns, plain_columns
from .dispersion import CHANNELS, dispersed, is_dispersive
from .fields import VARIABLE, Fields, constants, known_fields
from .programmed import allow_program, with_program
from .tabulated import Tabulated

Bools = NDArray[np.bool_]
Numbers = NDArray[np.intp]
THROUGH = ("reflectivity", "opacity", "transmission_tint", "ior")
"""What a shadow ray that crosses a surface asks of it."""
ANY_OF = (
    "emits", "shades_ambient", "shades_diffuse", "shades_specular", "reflects", "transmits", "clear", "rough", "blurs"
)  # fmt: skip
"""What a sum does if one of its closures does."""


@dataclass(frozen=True, eq=False)
class SurfaceTable:
    """One column for each of the s surfaces of a scene (one default surface if it has none), then one for each closure
    of those that are sums. A sum's column says what it may do; hits on it become hits on its closures."""

    ior: Float64  # (s,) inside over outside

    emits: Bools  # (s,) Le is not 0
    shades_ambient: Bools  # (s,) (1 - r) o ambient base_color can differ from 0
    shades_diffuse: Bools  # (s,) the same for the lights' diffuse part
    shades_specular: Bools  # (s,) and for the highlight
    straight: Bools  # (s,) IOR exactly 1: F = 0, rays pass unbent
    reflects: Bools  # (s,) a hit can spawn a reflected ray
    glossless: Bools  # (s,) its interface reflects nothing, and so passes all (Refraction)
    transmits: Bools  # (s,) a hit can spawn a refracted or straight ray
    clear: Bools  # (s,) and it brings more than FAINT
    rough: Bools  # (s,) what it reflects or refracts by rays may be blurred
    shadow_opaque: Bools  # (s,) blocks every shadow ray
    shadow_clear: Bools  # (s,) lets every shadow ray pass unchanged

    culled: Bools  # (s,) its back faces are not there,
    shadow_culled: Bools  # (s,) or not for lights

    varies: Bools  # (s,) what a hit gathers depends on its angle or place
    expressive: Bools  # (s,) expressions tell of it
    varies_through: Bools  # (s,) and of what it lets through
    layered: Bools  # (s,) it answers in layers
    blurs: Bools  # (s,) and may show the world blurred
    filmed: Bools  # (s,) a thin film colours what its interface reflects
    translucent: Bools  # (s,) its diffuse light is that of its other side
    scatters: Bools  # (s,) some of its diffuse light comes from elsewhere
    brushed: Bools  # (s,) its rough reflections are longer one way than the other
    tabulated: Tabulated  # what hits gather, by their cosines
    surfaces: tuple[Surface, ...]
    blur_roughness: tuple[float, float]  # of reflections that show the world blurred

    closure_count: Numbers  # (s,) how many closures it is the sum of; 0: it is a single one
    first_closure: Numbers  # (s,) the column of the first of them
    closure_weight: Float32  # (3, s) of closures, where no expression tells; 1 of all else
    owner: Numbers  # (s,) the surface that a closure is of; of all else itself
    band: Numbers  # (s,) the channel whose light a closure that disperses refracts; -1 of all else

    @property
    def disperses(self) -> bool:
        """Whether some closure splits light."""
        return bool((self.band >= 0).any())

    @cached_property
    def dispersion(self) -> Float64:
        """(s,) 20 / Abbe number."""
        return np.array([s.dispersion for s in self.surfaces], np.float64)

    @cached_property
    def programmed(self) -> Bools:
        """(s,) whether a program answers for it."""
        return np.array([s.program is not None for s in self.surfaces], bool)

    @cached_property
    def passes_straight(self) -> Bools:
        """(s,) whether what is behind may be seen straight through it."""
        closures = self.transmits & self.straight & (self.closure_count == 0)
        result: Bools = np.bincount(self.owner, closures, minlength=len(self.owner)) > 0
        return result

    @property
    def admits(self) -> Bools:
        """(s,) whether it may let some of the light through, and scatter some."""
        return self.transmits & self.shades_ambient

    @cached_property
    def mixes_glass(self) -> bool:
        """Whether some sum refracts by more than one closure."""
        count = np.bincount(self.owner, self.refracts & (self.closure_count == 0))
        return bool((count > 1).any())

    @cached_property
    def tint(self) -> Float32:
        """(3, s) of what passes; white where it varies."""
        tints = [s.transmission_tint for s in self.surfaces]
        return np.array([WHITE if isinstance(t, Expression) else t for t in tints], np.float32).T

    def closures_of(self, surface: Numbers) -> tuple[Numbers, Numbers, Numbers]:
        """The closures of surfaces (n,): which of the n each is of (m,), ascending, its column, its place in the sum.

        Of a single closure that is itself.
        """
        count = np.maximum(self.closure_count.take(surface), 1)
        owner = np.repeat(np.arange(len(surface)), count)
        part = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
        return owner, self.first_closure.take(surface)[owner] + part, part

    @property
    def columns(self) -> Columns:
        """What hits gather."""
        return self.tabulated.columns

    @property
    def shades_locally(self) -> Bools:
        """(s,) whether Llocal needs working out."""
        return self.shades_ambient | self.shades_diffuse | self.shades_specular

    @cached_property
    def known(self) -> tuple[list[Fields], list[Fields]]:
        """(s,) what no expression gives of them: of all fields, and of those that a crossing asks for."""
        return [known_fields(s) for s in self.surfaces], [known_fields(s, NOT_CROSSED) for s in self.surfaces]

    @property
    def refracts(self) -> Bools:
        """(s,) whether transmitted rays bend, hence spend a bounce."""
        return self.transmits & ~self.straight

    @property
    def absorption(self) -> Float64:
        """(3, s) 1/m, of the solids behind; of the scene's own table, hits have none."""
        return np.array([s.absorption for s in self.surfaces], np.float64).T

    @property
    def absorbs(self) -> Bools:
        """(s,) whether what passes through it meets a medium that absorbs."""
        result: Bools = self.transmits & (self.absorption != 0).any(axis=0)
        return result

    @property
    def bounds_solids(self) -> Bools:
        """(s,) whether closed bodies of it are solids: what is clear, and has both sides if it need not have them."""
        return self.clear & (self.refracts | self.absorbs | ~(self.culled | self.shadow_culled))


def passes_straight(surface: Surface) -> bool:
    """Whether what is behind may be seen straight through it."""
    if surface.closures:
        return any(passes_straight(closure.surface) for closure in surface.closures)
    return surface.opacity != 1.0 and surface.reflectivity != 1.0 and (surface.ior == 1.0 or surface.thin)


def shows_background(scene: Scene) -> bool:
    """Whether one may see straight through something ray traced."""
    seen = {
        number for i in scene.instances for number in i.surfaces if i.ray_traced or scene.surfaces[number].ray_traced
    }
    shapes: list[Sphere | Plane] = [*scene.spheres, *scene.planes]
    seen |= {shape.surface for shape in shapes if scene.is_ray_traced(shape)}
    return any(passes_straight(scene.surfaces[number]) for number in seen)


def with_expressions(surface: Surface) -> Surface:
    """The same surface without expressions where nothing asks for them."""
    if surface.closures:
        return replace(
            surface, closures=tuple(replace(c, surface=with_expressions(c.surface)) for c in surface.closures)
        )
    unused: dict[str, Any] = {}
    if surface.reflectivity == 0.0:
        unused |= {"reflection_tint": WHITE, "edge_tint": None}
    if surface.opacity == 1.0 or surface.reflectivity == 1.0:
        unused |= {"transmission_tint": WHITE, "interface_tint": WHITE}
    if surface.layered and surface.coat == 0.0:
        unused |= {"coat_tint": WHITE, "coat_roughness": 0.0}
    if surface.layered and surface.sheen == 0.0:
        unused |= {"sheen_tint": BLACK, "sheen_roughness": 0.0}
    if surface.film == 0.0:
        unused |= {"film_ior": 1.0, "metal_ior": None}
    varying = [name for name in unused if isinstance(getattr(surface, name), Expression)]
    return replace(surface, **{name: unused[name] for name in varying})


def layout(surface: Surface) -> dict[str, tuple[int, int]]:
    """What a surface reads of a mesh's corners: key -> (start, width)."""
    found, start = {}, 0
    for key in sorted(reads(surface)):
        width = ATTRIBUTE_WIDTHS[key.partition(":")[0]]
        found[key] = (start, width)
        start += width
    return found


def compile_surfaces(surfaces: Sequence[Surface]) -> SurfaceTable:
    """The table of all surfaces of a scene."""
    surfaces = tuple(with_program(dispersed(with_expressions(s))) for s in surfaces) or (Surface(),)
    sums, own = surfaces, len(surfaces)
    closures = [(number, closure) for number, s in enumerate(sums) for closure in s.closures]
    surfaces = (*sums, *(closure.surface for _, closure in closures))
    owner = np.array([*range(own), *(number for number, _ in closures)])
    count = np.bincount(owner[own:], minlength=len(surfaces))
    first = np.where(count > 0, own + np.cumsum(count) - count, np.arange(len(surfaces)))
    weight = np.ones((3, len(surfaces)), np.float32)
    for place, (_, closure) in enumerate(closures, own):
        weight[:, place] = 1.0 if isinstance(closure.weight, Expression) else closure.weight
    band = np.full(len(surfaces), -1)
    for place, (_, closure) in enumerate(closures, own):
        if is_dispersive(closure.surface):  # the three of one closure follow one another, red first
            known = closure.surface is surfaces[place - 1] and 0 <= band[place - 1] < len(CHANNELS) - 1
            band[place] = band[place - 1] + 1 if known and place > own else 0
    low, high = _bounds(surfaces, 0.0), _bounds(surfaces, 1.0)
    layered = np.array([s.layered for s in surfaces])
    through = [any(isinstance(getattr(s, name), Expression) for name in THROUGH) for s in surfaces]
    expressive = np.array([_is_expressive(s) for s in surfaces])
    tabulated = Tabulated(surfaces, plain_columns(high, len(surfaces)))
    blurs = layered & tabulated.blurs
    table = SurfaceTable(
        high["ior"][0], **_flags(low, high),
        culled=np.array([s.culled for s in surfaces]), shadow_culled=np.array([s.shadow_culled for s in surfaces]),
        varies=layered | expressive, expressive=expressive,
        varies_through=(layered | through) & expressive & ~tabulated.known, layered=layered, blurs=blurs,
        filmed=layered & (high["film"][0] > 0), translucent=np.array([s.translucent for s in surfaces]),
        scatters=(high["scatter"][0] > 0) & (high["scatter_radius"] > 0).any(0),
        brushed=layered & np.array([s.tangent is not None and s.stretch != 1.0 for s in surfaces]),
        tabulated=tabulated, surfaces=surfaces, blur_roughness=_blur_roughness(low, high, blurs),
        closure_count=count, first_closure=first, closure_weight=weight, owner=owner, band=band,
    )  # fmt: skip
    table = _with_layers(table, low, high, layered) if layered.any() else table
    table = _summed(table) if closures else table
    return replace(table, shadow_clear=table.shadow_clear & ~table.absorbs)


def _summed(table: SurfaceTable) -> SurfaceTable:
    """The table, whose sums may do what their closures do."""
    changed = {
        name: getattr(table, name).copy() for name in (*ANY_OF, "straight", "shadow_opaque", "shadow_clear", "ior")
    }
    for number in np.flatnonzero(table.closure_count).tolist():
        start = table.first_closure[number]
        part = slice(start, start + table.closure_count[number])
        for name in ANY_OF:
            changed[name][number] = getattr(table, name)[part].any()
        bent = np.flatnonzero(table.refracts[part])
        changed["straight"][number] = len(bent) == 0
        changed["ior"][number] = table.ior[start + bent[0]] if len(bent) else 1.0
        changed["shadow_opaque"][number] = table.shadow_opaque[part].all()
        changed["shadow_clear"][number] = False
        allow_program(table.surfaces[number].program, changed, number)
    return replace(table, **changed)


def _is_expressive(surface: Surface) -> bool:
    """Whether expressions tell of it; of a sum: of its weights."""
    if surface.closures:
        return any(isinstance(closure.weight, Expression) for closure in surface.closures)
    return bool(expressions_of(surface))


def _blur_roughness(low: Fields, high: Fields, blurs: Bools) -> tuple[float, float]:
    """From the smoothest to the roughest reflection that shows the world blurred."""
    coated = high["coat"][0] > 0
    lowest = np.minimum(low["roughness"][0], np.where(coated, low["coat_roughness"][0], 1))[blurs]
    highest = np.maximum(high["roughness"][0], np.where(coated, high["coat_roughness"][0], 0))[blurs]
    return float(np.min(lowest, initial=1.0)), float(np.max(highest, initial=0.0))


def _bounds(surfaces: Sequence[Surface], varying: float) -> dict[str, Float64]:
    """The fields with `varying` for whatever an expression gives."""

    def number(surface: Surface, name: str, size: int) -> Any:
        value = getattr(surface, name)
        if isinstance(value, Expression):
            return [varying] * size
        if value is None:
            return [1.0] * size
        return value if size == 3 else [value]

    fields = {
        name: np.ascontiguousarray(np.array([number(s, name, size) for s in surfaces], np.float64).T)
        for name, size in VARIABLE.items()
    }
    rest = [constants(s) for s in surfaces]
    return {**fields, **{name: np.array([[values[name] for values in rest]]) for name in rest[0]}}


def _flags(low: Fields, high: Fields) -> dict[str, Bools]:
    """What surfaces may do whose fields lie between `low` and `high`: for constants, what they do."""
    local = (1 - low["reflectivity"][0]) * high["opacity"][0]
    interface = (1 - low["reflectivity"][0]) * (1 - low["opacity"][0])
    passes = interface * high["transmission_tint"]
    least = (1 - high["reflectivity"][0]) * (1 - high["opacity"][0]) * low["transmission_tint"]
    straight, colored = high["ior"][0] == 1, (high["base_color"] != 0).any(0)
    reflects = (high["reflectivity"] * high["reflection_tint"] != 0).any(0)
    return {
        "emits": (high["emission"] != 0).any(0),
        "shades_ambient": (local != 0) & (high["ambient"][0] != 0) & colored,
        "shades_diffuse": (local != 0) & (high["diffuse"][0] != 0) & colored,
        "shades_specular": (local != 0) & (high["specular"] != 0).any(0),
        "straight": straight,
        "reflects": reflects | ((interface * high["interface_tint"] != 0).any(0) & ~straight),
        "glossless": (high["interface_tint"] == 0).all(0),
        "transmits": (passes != 0).any(0),
        "clear": (passes > FAINT).any(0),
        "rough": np.zeros(len(straight), bool),
        "shadow_opaque": (passes == 0).all(0),
        "shadow_clear": straight & (passes == 1).all(0) & (least == 1).all(0),
    }


def _with_layers(table: SurfaceTable, low: Fields, high: Fields, layered: Bools) -> SurfaceTable:
    """What layers may add: lobes of the metal, the dielectric and the coat, traced or not, and the sheen."""
    coat, glossy = high["coat"][0] > 0, (high["specular"] != 0).any(0)
    metal = high["reflectivity"][0] > 0
    body = high["opacity"][0] > 0
    sharp = (glossy & (low["roughness"][0] < TRACED_ROUGHNESS)) | (coat & (low["coat_roughness"][0] < TRACED_ROUGHNESS))
    pane = high["pane_ior"][0] != 1
    lit = (glossy & body) | coat | (high["sheen"][0] > 0)
    mirrors = metal | glossy & body | table.transmits | pane
    rough = layered & mirrors & (high["roughness"][0] > MIRROR_ROUGHNESS)
    rough |= layered & coat & (high["coat_roughness"][0] > MIRROR_ROUGHNESS)
    return replace(
        table,
        reflects=table.reflects | layered & (metal | sharp | pane),
        rough=rough,
        shades_ambient=table.shades_ambient | layered & lit,
        shades_diffuse=table.shades_diffuse | layered & (high["sheen"][0] > 0),
        shades_specular=np.where(layered, rough, table.shades_specular),
        shadow_clear=table.shadow_clear & ~layered,
    )
