# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects are ray traced, and with what values: words that render, plan, advise and report share."""

from __future__ import annotations

import argparse
import runpy
from collections.abc import Mapping
from difflib import get_close_matches
from importlib import import_module
from typing import Any

import bpy

from ...settings_table import SURFACE
from .. import api, flags
from ..errors import HybridError
from ..pipeline import scene_setup
from . import setting_flags


def add(parser: argparse.ArgumentParser) -> None:
    """Add the words to a verb's parser."""
    parser.add_argument(
        "--ray-traced", nargs="+", action="extend", metavar="NAME", help="flag these objects instead of the file's"
    )
    parser.add_argument(
        "--ray-traced-materials", nargs="+", action="extend", metavar="NAME",
        help="flag all faces that wear these materials instead of what the file flags",
    )  # fmt: skip
    parser.add_argument(
        "--surface", nargs="+", action="extend", metavar="OBJECT=PROGRAM",
        help="let surface programs answer for these objects",
    )  # fmt: skip
    parser.add_argument(
        "--surface-programs", metavar="FILE.py", help="run this Python file first: it registers surface programs"
    )
    setting_flags.add(parser, SURFACE)


def apply(scene: bpy.types.Scene, arguments: argparse.Namespace) -> None:
    """Flag the named objects and materials, with the values given; without names they go to all that is ray traced."""
    values = setting_flags.given(SURFACE, arguments)
    own = {b_object.name: b_object for b_object in scene.objects}
    if arguments.ray_traced or arguments.ray_traced_materials:
        flags.clear(scene)
        worn = {b_material.name: b_material for b_material in bpy.data.materials}
        objects, materials = arguments.ray_traced or (), arguments.ray_traced_materials or ()
        chosen = [find(own, name, "object", f"scene '{scene.name}'") for name in objects]
        chosen += [find(worn, name, "material", "this file") for name in materials]
    else:
        given = any(value is not None for value in values.values())
        ray_traced = flags.Flags(scene)
        chosen = [ob for ob in scene.objects if ray_traced.is_ray_traced(ob)] if given else []
        chosen += scene_setup.ray_traced_materials(scene) if given else []
        if given and not chosen:
            raise HybridError("no object is ray traced: name some with --ray-traced")
    for b_id in chosen:
        api.mark(b_id, **values)
    if arguments.surface_programs:
        _register(arguments.surface_programs)
    for pair in arguments.surface or ():
        name, equals, program = pair.partition("=")
        if not equals:
            raise HybridError(f"--surface {pair}: write OBJECT=PROGRAM")
        api.surface(find(own, name, "object", f"scene '{scene.name}'"), program or None)


def _register(path: str) -> None:
    """Run a Python file that registers surface programs; HybridError, one line, if it cannot be run."""
    try:
        runpy.run_path(path, init_globals={"hybrid": import_module(__package__.rpartition(".blender")[0])})
    except Exception as error:
        why = str(error).strip().splitlines()
        raise HybridError(f"--surface-programs {path}: {type(error).__name__}{': ' + why[0] if why else ''}") from None


def find(known: Mapping[str, Any], name: str, kind: str, where: str) -> Any:
    """An item by its name; HybridError, with the nearest name there is, if there is none."""
    if name in known:
        return known[name]
    close = get_close_matches(name, known, n=1)
    raise HybridError(f"no {kind} '{name}' in {where}" + (f"; did you mean '{close[0]}'?" if close else ""))
