# SPDX-License-Identifier: GPL-3.0-or-later
"""Every kernel gives the bits of its numpy twin, on random and on stiff input, of any length and layout."""

from __future__ import annotations

import copy
import dataclasses
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybrid_addon.tracer.render  # noqa: F401  all marked functions
from hybrid_addon import accelerated
from hybrid_addon.tracer.kernels import declare, loading

from . import inputs_of_highlights, inputs_of_images  # noqa: F401
from .inputs import INPUTS, MEANINGLESS, Source

loading._declared()
NAMES = [kernel.of for kernel in declare.DECLARED if not kernel.late]  # of tiles: test_tiles.py


def flat(result: Any) -> list[Any]:
    """All arrays and numbers of a result."""
    if isinstance(result, (tuple, list)):
        return [part for item in result for part in flat(item)]
    if dataclasses.is_dataclass(result):
        return [part for field in dataclasses.fields(result) for part in flat(getattr(result, field.name))]
    return [result]


def differences(name: str, args: tuple[Any, ...]) -> list[str]:
    """What differs between numpy's answer and the kernel's, in the results and in what is written to."""
    twins, own = accelerated.ALL[name], copy.deepcopy(args)
    assert twins.compiled is not None, accelerated.failed()
    twins.unmatched.clear()
    with np.errstate(all="ignore"):
        wanted, found = flat(twins.reference(*args)), flat(twins.run(twins.compiled, own))
    for i, columns in MEANINGLESS[name](*args).items() if name in MEANINGLESS else ():
        for results in (wanted, found):
            results[i] = np.where(columns, results[i].dtype.type(0), results[i])
    wanted, found = [*wanted, *flat(args)], [*found, *flat(own)]
    assert name not in accelerated.failed() and not twins.unmatched
    wrong = []
    for i, (a, b) in enumerate(zip(wanted, found, strict=True)):
        if a is None or b is None:
            same = a is b
        else:
            a, b = np.asarray(a), np.asarray(b)
            same = a.dtype == b.dtype and a.shape == b.shape
            same = same and bool(np.all((a == b) & (np.signbit(a) == np.signbit(b)) | (a != a) & (b != b)))
        if not same:
            wrong.append(f"{i}: {a} {b}")
    return wrong


@pytest.mark.parametrize("name", NAMES)
def test_a_kernel_gives_the_bits_of_numpy(loaded, name: str) -> None:
    rng = np.random.default_rng(7)
    for n, stiff, _ in product((0, 1, 3, 1000), (0.0, 0.3), range(4)):
        assert not differences(name, INPUTS[name](Source(rng, n, stiff))), (n, stiff)


@pytest.mark.parametrize("name", NAMES)
def test_arrays_may_lie_in_memory_as_they_like(loaded, name: str) -> None:
    args = INPUTS[name](Source(np.random.default_rng(8), 65))
    twins = accelerated.ALL[name]
    spread = [_spread(a) if i not in twins.written else a for i, a in enumerate(args)]
    assert not differences(name, tuple(spread))


@pytest.mark.parametrize("name", NAMES)
def test_a_column_or_row_that_numpy_would_repeat_is_work_for_numpy(loaded, name: str) -> None:
    """A kernel would read on behind it."""
    args, twins = INPUTS[name](Source(np.random.default_rng(10), 9)), accelerated.ALL[name]
    for i, a in enumerate(args):
        if isinstance(a, np.ndarray) and a.ndim == 2 and i not in (*twins.tables, *twins.of_rows):
            assert twins._ready((*args[:i], a[:1], *args[i + 1 :])) is None
        if isinstance(a, np.ndarray) and a.ndim and i not in twins.tables:
            one = (*args[:i], a[..., :1], *args[i + 1 :])
            assert twins._ready(one) is None or sum(isinstance(b, np.ndarray) for b in args) - len(twins.tables) == 1
    assert twins._ready(args) is not None, "tables= names the arrays that are not of one column for each ray"


def _spread(a: Any) -> Any:
    """The same numbers, every second element of a larger array, not to be written to."""
    if not isinstance(a, np.ndarray) or a.ndim == 0:
        return a
    wide = np.zeros((*a.shape[:-1], 2 * a.shape[-1]), a.dtype)
    wide[..., ::2] = a
    result = wide[..., ::2]
    result.flags.writeable = False
    return result


def test_every_marked_function_has_a_kernel_and_every_kernel_a_function() -> None:
    late = {kernel.of for kernel in declare.DECLARED if kernel.late}  # test_tiles compares them
    assert sorted(INPUTS) == sorted(NAMES) and {*NAMES, *late} == set(accelerated.ALL)


def test_the_comparison_finds_one_wrong_bit(loaded) -> None:
    name = NAMES[0]
    twins = accelerated.ALL[name]
    args = INPUTS[name](Source(np.random.default_rng(9), 50))
    right = twins.compiled
    assert right is not None

    def wrong(*args: Any) -> Any:
        first, *rest = right(*args)
        first[30] = np.nextafter(first[30], np.float32(9))
        return first, *rest

    twins.compiled = wrong
    try:
        assert differences(name, args)
    finally:
        twins.compiled = right


def test_a_kernel_that_fails_is_one_warning_and_numpy(monkeypatch) -> None:
    monkeypatch.setattr(accelerated, "_failed", {})
    monkeypatch.setattr(accelerated, "_warned", [])
    twins = accelerated.Twins("tracer.no.such", lambda a: a + 1)

    def broken(a: Any) -> Any:
        raise ZeroDivisionError("no luck")

    twins.kernel = broken
    with pytest.warns(UserWarning, match="tracer.no.such failed, numpy does its work.*no luck"):
        assert twins.run(broken, (1,)) == 2
    assert twins.kernel is None and list(accelerated.failed()) == ["tracer.no.such"]


def test_what_a_kernel_is_made_of_decides_whether_the_cache_has_it() -> None:
    first = loading.fingerprint(eval("lambda a: a + ONE", {"ONE": np.float32(1)}))
    assert first == loading.fingerprint(eval("lambda a: a + ONE", {"ONE": np.float32(1)}))
    others = [("a + ONE", np.float32(2)), ("a + ONE", np.float64(1)), ("a - ONE", np.float32(1))]
    assert first not in [loading.fingerprint(eval(f"lambda a: {text}", {"ONE": one})) for text, one in others]


def test_a_cache_that_cannot_be_written_costs_time_and_nothing_is_fused(monkeypatch, tmp_path: Path) -> None:
    """The machine code of a + b c has two operations: fused they would round once, where numpy rounds twice."""

    def add(a, b, c, out):
        for i in range(len(a)):
            out[i] = a[i] + b[i] * c[i]

    (tmp_path / "file").write_text("in the way")
    monkeypatch.setattr(loading, "_folder", [tmp_path / "file" / "kernels"])
    types = (declare.f4[1],) * 3 + (declare.written(declare.f4[1]),)
    made = loading.compiled(declare.Kernel("", add, [types]))
    ones, out = np.ones(5, np.float32), np.zeros(5, np.float32)
    made(ones, ones, ones, out)
    (code,) = made.inspect_asm().values()
    assert (out == 2).all() and "mul" in code and "fmadd" not in code and "fmla" not in code
