# SPDX-License-Identifier: GPL-3.0-or-later
"""exp, sin and their kin: how far they are off, what becomes of special numbers, and the same bits for everybody."""

from __future__ import annotations

import ast
import hashlib
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from hybrid_addon.procedural import elementary
from hybrid_addon.procedural.elementary_core import swap

Array = NDArray[Any]
PACKAGE = Path(__file__).resolve().parent.parent / "hybrid_addon"

ONE = ("exp", "expm1", "log", "log1p", "sin", "cos", "tan", "arctan", "arcsin", "arccos")
TWO = ("arctan2", "power")
DIGEST = "157c70ba17d5a666889e5852"
"""Of the results for `any_numbers`, the same for all versions of numpy, all processors and the compiled kernels."""


def numbers(dtype: type, low: float, high: float, n: int = 4000) -> Array:
    """Spread evenly, as this dtype has them."""
    return (low + (high - low) * ((np.arange(n) * 0.6180339887498949) % 1)).astype(dtype)


def powers(dtype: type, low: float, high: float) -> Array:
    """Spread evenly over exponents of 10, of either sign."""
    x = 10 ** numbers(np.float64, low, high)
    return (x * np.where(np.arange(len(x)) % 2, 1, -1)).astype(dtype)


def any_numbers(dtype: type, factor: int, n: int = 1 << 12) -> Array:
    """Numbers of all bit patterns: any size and sign, infinities, NaN, those that are not normal."""
    kind = np.uint32 if dtype is np.float32 else np.uint64
    with np.errstate(over="ignore"):
        return (np.arange(n, dtype=kind) * kind(factor)).view(dtype)


Case = tuple[str, float, float, Callable[[type], Array]]
CASES: list[Case] = [
    ("exp", 1.5, 1.5, lambda t: numbers(t, -80, 80)),
    ("exp", 1.5, 1.5, lambda t: numbers(t, -103, -87) if t is np.float32 else numbers(t, -745, -700)),
    ("expm1", 2.5, 2.5, lambda t: numbers(t, -3, 3)),
    ("expm1", 2.5, 2.5, lambda t: powers(t, -30, 0)),
    ("log", 1.5, 1.5, lambda t: np.abs(powers(t, -37, 37))),
    ("log", 1.5, 1.5, lambda t: numbers(t, 0.7, 1.4)),
    ("log", 1.5, 1.5, lambda t: np.abs(powers(t, -44, -38) if t is np.float32 else powers(t, -320, -308))),
    ("log1p", 1.5, 1.5, lambda t: numbers(t, -0.999, 2)),
    ("log1p", 1.5, 1.5, lambda t: powers(t, -30, -0.1)),
    ("sin", 2.5, 2.5, lambda t: numbers(t, -1.6e6, 1.6e6)),
    ("sin", 2.5, 2.5, lambda t: powers(t, -30, 1)),
    ("sin", 2.5, 2.5, lambda t: (np.arange(-4000, 4000) * (np.pi / 2)).astype(t)),
    ("cos", 2.5, 2.5, lambda t: numbers(t, -1e4, 1e4)),
    ("cos", 2.5, 2.5, lambda t: (np.arange(-4000, 4000) * (np.pi / 2)).astype(t)),
    ("tan", 4, 4, lambda t: numbers(t, -1e4, 1e4)),
    ("arctan", 3, 3, lambda t: powers(t, -30, 30)),
    ("arctan", 3, 3, lambda t: numbers(t, -3, 3)),
    ("arcsin", 4, 4, lambda t: numbers(t, -1, 1)),
    ("arccos", 4, 4, lambda t: numbers(t, -1, 1)),
]


def off(found: Array, exact: Array) -> float:
    """The largest error, in units of the last place of what is right."""
    return float(np.max(np.abs(found - exact) / np.spacing(np.abs(exact).astype(found.dtype))))


@pytest.mark.skipif(np.finfo(np.longdouble).nmant < 60, reason="no longer numbers here to measure by")
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("case", CASES, ids=lambda case: case[0])
def test_errors_are_as_small_as_stated(case: Case, dtype: type) -> None:
    name, short, long, places = case
    x = places(dtype)
    with np.errstate(all="ignore"):
        exact = getattr(np, name)(x.astype(np.longdouble))
    assert off(getattr(elementary, name)(x), exact) <= (short if dtype is np.float32 else long)


@pytest.mark.skipif(np.finfo(np.longdouble).nmant < 60, reason="no longer numbers here to measure by")
def test_errors_of_two_numbers_are_as_small_as_stated() -> None:
    y, x = powers(np.float64, -3, 3), powers(np.float64, -3, 3)[::-1].copy()
    base, exponent = np.abs(x), numbers(np.float64, -5, 5)
    for dtype in (np.float32, np.float64):
        a, b, c, d = (np.asarray(v, dtype) for v in (y, x, base, exponent))
        far = [v.astype(np.longdouble) for v in (a, b, c, d)]
        assert off(elementary.arctan2(a, b), np.arctan2(far[0], far[1])) <= 3
        doubt = np.float64(2 + 2 * np.abs(d * np.log(c))) if dtype is np.float64 else np.float64(0.6)
        exact = np.power(far[2], far[3])
        assert (np.abs(elementary.power(c, d) - exact) <= doubt * np.spacing(exact.astype(dtype))).all()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_special_numbers_are_as_in_c(dtype: type) -> None:
    """C99, annex F: signs (of 0, too, where angles and powers have one), infinities, NaN; and what is exact."""
    special = np.array([0, -0.0, 1, -1, 2, -2, 3, -3, 0.5, -0.5, np.inf, -np.inf, np.nan, 1e-40, -1e-40, 1e30], dtype)
    a, b = (grid.ravel() for grid in np.meshgrid(special, special))
    of_large_angles = {name: (special[:-1],) for name in ("sin", "cos", "tan")}  # theirs is another 1e30
    for name in (*ONE, *TWO):
        given = (a, b) if name in TWO else of_large_angles.get(name, (special,))
        found = getattr(elementary, name)(*given)
        with np.errstate(all="ignore"):
            right = getattr(np, name)(*(v.astype(np.longdouble) for v in given)).astype(dtype)
        assert found.dtype == dtype
        np.testing.assert_allclose(found, right, rtol=200 * float(np.finfo(dtype).eps), err_msg=name)
        there = ~np.isnan(right) & ((right != 0) | (name in TWO))
        assert (np.signbit(found) == np.signbit(right))[there].all(), name
    exact = {"exp": (0, 1), "expm1": (0, 0), "log": (1, 0), "cos": (0, 1), "sin": (0, 0), "arctan": (0, 0)}
    for name, (x, y) in exact.items():
        assert getattr(elementary, name)(dtype(x)) == y, name


def test_too_large_and_too_small_is_infinite_and_0() -> None:
    for dtype in (np.float32, np.float64):
        x = np.array([1e5, 89.0 if dtype is np.float32 else 710.0, -1e5], dtype)
        assert list(elementary.exp(x)) == [np.inf, np.inf, 0]
        assert list(elementary.expm1(x)) == [np.inf, np.inf, -1]


def test_huge_angles_have_a_sine() -> None:
    for x in (np.float32(3e7), np.float32(1e38), np.float64(1e300)):
        sine, cosine = elementary.sincos(x)
        assert abs(sine * sine + cosine * cosine - 1) < 1e-6
    # Up to 1e8 they are right to the digits of the angle.
    x = numbers(np.float64, 1.6e6, 1e8)
    exact = np.sin(x.astype(np.longdouble)).astype(np.float64)
    np.testing.assert_allclose(elementary.sin(x), exact, atol=1e8 * 2.0**-54)


def test_results_depend_on_the_number_alone() -> None:
    """Not on its neighbours, nor on the array's length and shape; large angles and odd numbers stand beside others."""
    x = np.concatenate([numbers(np.float32, -9, 9, 40_000), any_numbers(np.float32, 2654435761, 200)])
    for name in ("exp", "log", "log1p", "sin", "cos", "arctan"):
        whole = getattr(elementary, name)(x)
        picked = np.r_[0:5, 16_380:16_390, 39_990:40_100]
        alone = np.array([getattr(elementary, name)(v) for v in x[picked]])
        np.testing.assert_array_equal(whole[picked], alone)
        np.testing.assert_array_equal(getattr(elementary, name)(x[:30].reshape(5, 6).T), whole[:30].reshape(5, 6).T)


def test_small_angles_and_exchanged_numbers() -> None:
    x = numbers(np.float32, -np.pi / 4, np.pi / 4)
    for near, any_ in zip(elementary.sincos_near_0(x), elementary.sincos(x), strict=True):
        np.testing.assert_array_equal(near, any_)
    a, b = np.array([1.0, -0.0, np.nan]), np.array([2.0, 5.0, 3.0])
    swap(np.array([True, True, False]), a, b)
    assert list(a[:2]) == [2, 5] and np.signbit(b[1]) and np.isnan(a[2])


def test_the_bits_are_everybodys() -> None:
    content = hashlib.blake2b(digest_size=12)
    for dtype, factors in (
        (np.float32, (0x9E3779B1, 0x85EBCA77)),
        (np.float64, (0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F)),
    ):
        x, y = (any_numbers(dtype, factor) for factor in factors)
        plain = numbers(dtype, -20, 20), numbers(dtype, -6, 6)
        for a, b in ((x, y), plain):
            for name in (*ONE, *TWO):
                found = getattr(elementary, name)(*((a,) if name in ONE else (a, b)))
                # Which NaN it is processors choose.
                content.update(np.where(np.isnan(found), dtype(0), found).tobytes())
    assert content.hexdigest() == DIGEST


NOT_OURS = set(ONE) | set(TWO) | {
    "exp2", "log2", "log10", "sinh", "cosh", "tanh", "arcsinh", "arccosh", "arctanh", "hypot", "cbrt", "float_power",
    "logaddexp", "atan", "atan2", "asin", "acos", "pow", "sincos",
}  # fmt: skip


SUSPECT = re.compile(rf"\*\*|\b(np|math)\.({'|'.join(sorted(NOT_OURS))})\b")


def others(source: str) -> Iterator[str]:
    """Elementary functions of numpy, math or Python's ** in a source; squares and constants are exact."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in ("np", "math"):
            if node.attr in NOT_OURS:
                yield f"{node.lineno}: {node.value.id}.{node.attr}"
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
            exponent = ast.unparse(node.right)
            base = node.left.value if isinstance(node.left, ast.Constant) else None
            if exponent != "2" and base != 2 and not (base and isinstance(node.right, ast.Constant)):
                yield f"{node.lineno}: {ast.unparse(node)}"


def test_the_tracer_uses_no_others() -> None:
    found = {
        str(path.relative_to(PACKAGE)): bad
        for room in ("tracer", "procedural")
        for path in (PACKAGE / room).rglob("*.py")
        if SUSPECT.search(source := path.read_text(encoding="utf-8")) and (bad := list(others(source)))
    }
    assert not found
    assert sorted(others("x**2 + np.sin(x) + 2**32 + a**b + math.sqrt(2)")) == ["1: a ** b", "1: np.sin"]
