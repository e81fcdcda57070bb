# SPDX-License-Identifier: GPL-3.0-or-later
"""The flags that set what `Scene.hybrid`, or an object, has a property for: made from the table of settings."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable
from typing import Any

from ...settings_table import BY_NAME, LARGEST_FLAG, Setting
from .common import number

UNITS = {"TIME_ABSOLUTE": "SECONDS", "LENGTH": "METRES"}


def add(parser: argparse.ArgumentParser, settings: Iterable[Setting]) -> None:
    """Add a flag for each setting; one that is not given is None."""
    for setting in settings:
        flag = "--" + setting.name.replace("_", "-")
        if setting.kind == "BOOL":
            parser.add_argument(flag, action=argparse.BooleanOptionalAction, help=setting.flag)
        elif setting.kind == "ENUM":
            keys = [key.lower() for key in setting.keys]
            if setting.tick:  # the flag alone is On, and with `no-` before it Off
                off, on = (key.lower() for key in setting.tick)
                parser.add_argument(flag, nargs="?", const=on, choices=keys, help=setting.flag)
                parser.add_argument(f"--no-{flag[2:]}", action="store_const", const=off, dest=setting.name, help=off)
            else:
                parser.add_argument(flag, choices=keys, help=setting.flag)
        else:
            parser.add_argument(flag, metavar=_metavar(setting), type=value_of(setting.name), help=setting.flag)


def value_of(name: str) -> Callable[[str], Any]:
    """What turns a word of the command line into a value of this setting, a number; an error names its range."""
    setting = BY_NAME[name]
    low, high = setting.bounds
    return number(low, high if setting.high is not None else LARGEST_FLAG, int if setting.kind == "INT" else float)


def given(settings: Iterable[Setting], arguments: argparse.Namespace) -> dict[str, Any]:
    """What the flags of these settings hold, by the settings' names; None where one was not given."""
    return {setting.name: getattr(arguments, setting.name) for setting in settings}


def _metavar(setting: Setting) -> str:
    return UNITS.get(setting.unit or "", "N" if setting.kind == "INT" else "X")
