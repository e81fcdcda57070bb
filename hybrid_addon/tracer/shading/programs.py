# SPDX-License-Identifier: GPL-3.0-or-later
"""Calls surface programs, and keeps what goes wrong in one to the object that it is for.

To the rest of the tracer a program is the first closure of its surface; the object's material are those after it. Where
it fails, the material answers alone.
"""

from __future__ import annotations

import ctypes
import threading
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...scene import Float32, Float64
from ...scene.programs import SurfaceAnswer, SurfaceHits, SurfaceProgram
from ..core.constants import FLOAT32_ULP
from ..core.rays import origin_offset
from ..core.stats import Stats
from ..core.vectors import Index, dot, flatnonzero, select, take
from ..geometry.hits import Hits
from ..materials.surfaces import SurfaceTable
from ..prepare.compiled import CompiledScene
from .interaction import Interaction
from .scattering import mirror_directions

Bools = NDArray[np.bool_]
Numbers = NDArray[np.intp]

NOTE = "surface program:"
"""How names of counters begin that say what went wrong."""
PINK = np.array([[1.0], [0.0], [1.0]], np.float32)
"""What is not a number is shown so, and passes nothing."""

_hung: dict[int, Any] = {}
"""Functions that took too long once in this process, by their identities."""


@dataclass(frozen=True, eq=False)
class Answers:
    """What programs said of n hits; zeros where none stands.

    here         : (n,) bool, it is a program's hit.
    radiance, reflection, transmission : (3, n) float32.
    reflected, transmitted : (3, n) float32 unit directions; 0: the mirror's, and straight on.
    origin       : (3, n) float32, relative to the scene's centre; NaN: at the surface.
    material     : (3, n) float32.
    notes        : what went wrong, and how often.
    """

    here: Bools
    radiance: Float32
    reflection: Float32
    transmission: Float32
    reflected: Float32
    transmitted: Float32
    origin: Float32
    material: Float32
    notes: Counter[str]

    def take(self, index: Index) -> Answers:
        """Those of the hits `index`."""
        arrays: dict[str, Any] = {name: take(getattr(self, name), index) for name in ARRAYS}
        return replace(self, **arrays)

    def share(self, throughput: Float32, reflected: Float32, transmitted: Float32, bends: Bools) -> tuple[Any, ...]:
        """The arrays (3, n), (3, n), (n,) of `spawn.Split`, with what programs send."""
        return (
            np.where(self.here, throughput * self.reflection, reflected),
            np.where(self.here, throughput * self.transmission, transmitted),
            bends | self.here,
        )

    def mirrored(self, index: Index, direction: Float32) -> Float32:
        """Directions (3, m) of reflected rays of the hits `index`."""
        own = take(self.reflected, index)
        return np.asarray(np.where(own.any(axis=0), own, direction), np.float32)

    def passed_on(self, at: Interaction, index: Index, direction: Float32) -> tuple[Float32, Float32, Bools]:
        """Origins and directions (3, m) of transmitted rays, and which (m,) start elsewhere."""
        own, here, origin = take(self.transmitted, index), take(self.here, index), take(self.origin, index)
        straight = np.where(here, -take(at.wo, index), direction)
        direction = np.where(own.any(axis=0), own, straight).astype(np.float32, copy=False)
        elsewhere = np.isfinite(origin).all(axis=0) & here
        # On a surface it would hit that at once.
        started = origin + direction * origin_offset(origin, np.zeros(1, np.float32))
        return (
            np.where(elsewhere, started, at.inner(index)).astype(np.float32, copy=False), direction, elsewhere
        )  # fmt: skip


ARRAYS = tuple(field.name for field in fields(Answers))[:-1]


def answers_at(scene: CompiledScene, at: Interaction, t: Float64, depth: NDArray[np.int16]) -> Answers | None:
    """What programs say of hits (n,), at distances t along their rays; None: there is no program among them."""
    table, n = scene.surfaces, len(t)
    programmed = table.programmed.take(at.surface)
    if not programmed.any():
        return None
    found = _nothing(n)
    found.here[:] = programmed
    for program, number, rows in _groups(scene, table, at.surface, at.prim, flatnonzero(programmed)):
        wo, normal, facing = (take(a, rows) for a in (at.wo, at.n_shading, at.n_geometric))
        hits = _hits(
            scene, program, number, at.point[:, rows], normal, facing, wo, t[rows], at.entering[rows], depth[rows]
        )
        answer = _called(scene, program, number, program.hit, hits, found.notes)
        if answer is not None and not isinstance(answer, SurfaceAnswer):
            _note(scene, program, number, f"it gave {type(answer).__name__}, not a SurfaceAnswer", found.notes, rows)
            answer = None
        try:
            if answer is not None:
                _store(scene, found, rows, answer, program, number)
                continue
        except (ValueError, TypeError) as error:
            _note(scene, program, number, _line(error), found.notes, rows)
        found.here[rows] = False
        found.material[:, rows] = 1
    return found


def weighted(
    found: Answers, table: SurfaceTable, at: Interaction, owner: Numbers, part: Numbers, weight: Float32
) -> Float32:
    """The weights (3, m) of closures at hits `owner`, the `part`-th of theirs, as programs want them."""
    programmed = table.programmed.take(at.surface)[owner]
    own = programmed & (part == 0)
    weight = np.where(programmed & ~own, weight * found.material[:, owner], weight)
    return np.asarray(np.where(own, found.here[owner], weight), np.float32)


def shadows_passed(
    scene: CompiledScene, prim: Numbers, surface: Numbers, hits: Hits, origin: Float32, d: Float32, share: Float32,
    notes: Counter[str],
) -> Float32:  # fmt: skip
    """Shares (3, n) that pass at crossings, with those that programs tell of."""
    table = scene.surfaces
    asked = flatnonzero(table.programmed.take(surface))
    if len(asked) == 0:
        return share
    share = share.copy()
    for program, number, rows in _groups(scene, table, surface, prim, asked):
        if program.shadow is None:
            continue
        wi, t, entering = d[:, rows], hits.t[rows], hits.toward[rows] < 0
        facing = (hits.normal[:, rows] * -np.sign(hits.toward[rows])).astype(np.float32)
        point = origin[:, rows] + wi * t
        of = _hits(scene, program, number, point, facing, facing, -wi, t, entering, None)
        passes = _called(scene, program, number, program.shadow, of, notes)
        if passes is None:
            continue
        try:
            passes = np.array(np.broadcast_to(np.asarray(passes, np.float32), (3, len(rows))))
        except (ValueError, TypeError) as error:
            _note(scene, program, number, _line(error), notes, rows)
            continue
        wrong = ~np.isfinite(passes).all(axis=0)
        if wrong.any():
            _note(scene, program, number, "not a number", notes, flatnonzero(wrong))
            passes[:, wrong] = 0
        share[:, rows] = np.clip(passes, 0, 1)
    return share


def _nothing(n: int) -> Answers:
    zeros = (np.zeros((3, n), np.float32) for _ in range(7))
    radiance, reflection, transmission, reflected, transmitted, origin, material = zeros
    origin[:] = np.nan
    return Answers(
        np.zeros(n, bool), radiance, reflection, transmission, reflected, transmitted, origin, material, Counter()
    )


def _groups(scene: CompiledScene, table: SurfaceTable, surface: Numbers, prim: Numbers, rows: Numbers) -> Any:
    """Of the hits `rows` those of one program and object at a time: program, number of the object, which (k,)."""
    number = scene.geometry.object.take(prim[rows]).astype(np.intp)
    key = number * len(table.owner) + surface[rows]
    for one in np.unique(key).tolist():
        program = table.surfaces[one % len(table.owner)].program
        assert program is not None
        yield program, one // len(table.owner), rows[key == one]


def _hits(
    scene: CompiledScene, program: SurfaceProgram, number: int, point: Float64, normal: Float32, facing: Float32,
    wo: Float32, t: Float64, entering: Bools, depth: NDArray[np.int16] | None,
) -> SurfaceHits:  # fmt: skip
    return SurfaceHits(
        point=point + scene.geometry.center[:, None],
        normal=normal,
        geometric_normal=facing,
        wo=wo,
        mirror=mirror_directions(wo, normal, facing, True),
        distance=np.asarray(t, np.float64),
        entering=entering,
        depth=depth,
        object_name=scene.names[number],
        object_matrix=scene.matrices[number].copy() if number < len(scene.matrices) else np.eye(4),
        values=program.values,
    )


def _called(
    scene: CompiledScene, program: SurfaceProgram, number: int, function: Callable[[SurfaceHits], Any],
    hits: SurfaceHits, notes: Counter[str],
) -> Any:  # fmt: skip
    """What the function says; None: it failed, which is noted.

    It runs on a thread of its own: one that does not return in time is told to stop, and left alone.
    """
    rows = np.arange(len(hits))
    if id(function) in _hung:
        _note(scene, program, number, f"took longer than {program.patience:g} s: not called again", notes, rows)
        return None
    given: list[Any] = []

    def work() -> None:
        try:
            with np.errstate(all="ignore"):
                given.append(function(hits))
        except (Exception, SystemExit) as error:
            given.append(error)

    thread = threading.Thread(target=work, daemon=True, name=f"surface program {program.name}")
    thread.start()
    thread.join(program.patience)
    if thread.is_alive():
        _hung[id(function)] = function
        # Ends what loops in Python; what waits within a library goes on by itself, and its answer is not heard.
        ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread.ident or 0), ctypes.py_object(SystemExit))
        return _called(scene, program, number, function, hits, notes)
    if not given or isinstance(given[0], BaseException):
        _note(scene, program, number, _line(given[0]) if given else "it ended its thread", notes, rows)
        return None
    return SurfaceAnswer(material=1.0) if given[0] is None and function is program.hit else given[0]


def _store(
    scene: CompiledScene, found: Answers, rows: Numbers, answer: SurfaceAnswer, program: SurfaceProgram, number: int
) -> None:
    """Keep an answer for the hits `rows`. Raises ValueError for what does not broadcast."""
    n = len(rows)

    def filled(value: Any) -> Float32:
        return np.array(np.broadcast_to(np.asarray(value, np.float32), (3, n)))

    parts = {name: filled(getattr(answer, name)) for name in ("radiance", "reflection", "transmission", "material")}
    wrong = ~np.isfinite(np.concatenate(list(parts.values()))).all(axis=0)
    for name in ("reflected", "transmitted"):
        if getattr(answer, name) is not None:
            toward = np.array(np.broadcast_to(np.asarray(getattr(answer, name), np.float64), (3, n)))
            length = np.sqrt(dot(toward, toward))
            bad = ~np.isfinite(length) | (length == 0)
            wrong |= bad & (parts["reflection" if name == "reflected" else "transmission"] != 0).any(axis=0)
            unit = np.where(np.abs(length - 1) <= UNIT, toward, toward / np.where(bad, 1, length))
            getattr(found, name)[:, rows] = np.where(bad, 0, unit)
    if answer.origin is not None:
        place = np.broadcast_to(np.asarray(answer.origin, np.float64), (3, n)) - scene.geometry.center[:, None]
        found.origin[:, rows] = place
    if wrong.any():
        _note(scene, program, number, "not a number: pink", found.notes, flatnonzero(wrong))
    for name, part in parts.items():
        getattr(found, name)[:, rows] = np.where(wrong, PINK if name == "radiance" else 0, np.maximum(part, 0))


UNIT = 8 * FLOAT32_ULP
"""Directions whose lengths differ so little from 1, some ulp of float32, are left as they are: they keep their bits."""


def _note(
    scene: CompiledScene, program: SurfaceProgram, number: int, why: str, notes: Counter[str], rows: Numbers
) -> None:
    notes[f"{NOTE}object '{scene.names[number]}': surface program '{program.name}': {why}"] += len(rows)


def _line(error: BaseException) -> str:
    """What went wrong, in one line."""
    return f"{type(error).__name__}: {error}".strip().splitlines()[0].rstrip(": ")


def without(at: Interaction, part: Numbers) -> Interaction:
    """The hits on closures, of which only those on the first, which is the program's, have answers."""
    assert at.answers is not None
    return replace(at, answers=replace(at.answers, here=at.answers.here & (part == 0)))


def sent_by_programs(at: Interaction, stats: Stats) -> list[tuple[Index, Float32]]:
    """Which hits send what radiance (3, m) by themselves, and count what went wrong there."""
    if at.answers is None:
        return []
    stats.counts.update(at.answers.notes)
    index = select(at.answers.here)
    return [(index, take(at.answers.radiance, index))]


def problems(stats: Stats) -> tuple[str, ...]:
    """What went wrong in programs, a line each, and how often."""
    found = sorted((name.removeprefix(NOTE), n) for name, n in stats.counts.items() if name.startswith(NOTE))
    return tuple(f"{line} ({n} hits)" for line, n in found)
