# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of settings: what its rows let through, and that all which is made from it has the same names."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Any

import pytest

from hybrid_addon.presets import Quality
from hybrid_addon.scene import Settings
from hybrid_addon.settings_table import BY_NAME, RENDER, RETRACE, SCENE, SURFACE, checked, described


@pytest.mark.parametrize("setting", BY_NAME.values(), ids=lambda setting: setting.name)
def test_a_default_is_a_value_that_it_may_have(setting: Any) -> None:
    assert setting.checked(setting.default) == setting.default


@pytest.mark.parametrize(
    ("name", "value", "taken"),
    [
        ("samples", 65536, 65536),
        ("cutoff", 0, 0.0),
        ("mode", "full", "FULL"),
        ("traced_shadows", True, "ON"),
        ("traced_shadows", False, "OFF"),
        ("traced_shadows", "auto", "AUTO"),
        ("raster_backed", 0, False),
        ("time_budget", 1e7, 1e7),
        ("passes", {"depth"}, {"DEPTH"}),
    ],
)
def test_what_may_be_is_taken(name: str, value: Any, taken: Any) -> None:
    assert BY_NAME[name].checked(value) == taken


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("samples", 0, "samples is 0: it must lie between 1 and 65536"),
        ("samples", 1.5, "samples is 1.5: it must be a whole number"),
        ("cutoff", math.nan, "cutoff is nan: it must lie between 0 and 1"),
        ("time_budget", math.inf, "time_budget is inf: "),
        ("cutoff", "much", "cutoff is 'much': it must be a number"),
        ("mode", "sketch", "mode is 'SKETCH': it must be one of hybrid, raster, full"),
        ("mode", True, "mode is 'TRUE': "),
        ("raster_backed", "no", "raster_backed is 'no': it must be True or False"),
        ("passes", {"fog"}, "it must be some of depth, normal"),
    ],
)
def test_what_may_not_be_is_one_line(name: str, value: Any, words: str) -> None:
    with pytest.raises(ValueError, match=words) as raised:
        checked(SCENE, {name: value}, "render()")
    assert "\n" not in str(raised.value)


def test_a_name_that_there_is_not_is_told_of_with_the_nearest() -> None:
    with pytest.raises(TypeError, match=r"^retrace\(\) has no setting 'smaples'; did you mean 'samples'\?$"):
        checked(RETRACE, {"smaples": 4}, "retrace()")
    with pytest.raises(TypeError, match="no setting 'mode'"):
        checked(RETRACE, {"mode": "FULL"}, "retrace()")


def test_what_is_none_is_not_given() -> None:
    assert checked(RENDER, {"samples": None, "threads": 2}, "render()") == {"threads": 2}


def test_each_name_is_once_and_has_what_people_read() -> None:
    assert len(BY_NAME) == len(SURFACE) + len(SCENE)
    assert all(setting.label and setting.description for setting in BY_NAME.values())
    assert all(setting.flag for setting in (*SURFACE, *RENDER))
    assert all(setting.name in described(RENDER) for setting in RENDER)


def test_presets_set_what_there_is() -> None:
    names = {field.name for field in fields(Quality)}
    assert names <= {setting.name for setting in RENDER} and names <= {field.name for field in fields(Settings)}
