# SPDX-License-Identifier: GPL-3.0-or-later
"""Sky Texture -> an equirectangular image, drawn by Cycles in a Blender of its own.

What the models compute is Blender's own secret (tables, and integrals over the atmosphere); so the node, with its
settings, is drawn once for all directions. No file of the artist's is opened there, only numbers are handed over. The
image is kept as long as Blender runs: other frames and renders of the same sky take it as it is.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections import OrderedDict
from pathlib import Path
from typing import Any

import bpy

from ...scene import Texels
from .image import SRGB_WORKING_SPACES, working_space
from .image_file import read_file

HEIGHT = 512  # rows of the image: 0.35 degrees
SECONDS = 120  # for it, before it is given up
MOST_KEPT = 16  # skies, of 8 MB each
SCRIPT = Path(__file__).with_name("skybake.py")

_kept: OrderedDict[str, Texels | str] = OrderedDict()


def settings_of(b_node: bpy.types.Node) -> dict[str, Any]:
    """Of a Sky Texture node, as plain data; without the sun's disk, which EEVEE does not draw."""
    common = bpy.types.ShaderNode.bl_rna.properties
    found = {}
    for b_property in b_node.bl_rna.properties:
        if b_property.identifier in common or b_property.type not in ("FLOAT", "INT", "BOOLEAN", "ENUM"):
            continue
        value = getattr(b_node, b_property.identifier)
        found[b_property.identifier] = (
            list(value) if hasattr(value, "__len__") and b_property.type == "FLOAT" else value
        )
    return {**found, "sun_disc": False}


def baked(settings: dict[str, Any]) -> Texels | str:
    """(HEIGHT, 2 HEIGHT) texels; or why there is none, in a few words."""
    if working_space() not in SRGB_WORKING_SPACES:
        return f"skies are not drawn in the working space {working_space()}"
    key = json.dumps(settings, sort_keys=True)
    if key not in _kept:
        _kept[key] = _draw(settings)
        while len(_kept) > MOST_KEPT:
            _kept.popitem(last=False)
    _kept.move_to_end(key)
    return _kept[key]


def _draw(settings: dict[str, Any]) -> Texels | str:
    with tempfile.TemporaryDirectory(prefix="hybrid_sky_", dir=bpy.app.tempdir or None) as folder:
        order, picture = os.path.join(folder, "order.json"), os.path.join(folder, "sky.exr")
        with open(order, "w", encoding="utf-8") as file:
            json.dump({"settings": settings, "height": HEIGHT}, file)
        try:
            done = subprocess.run(
                [*_blender(), "--", order, picture], timeout=SECONDS, check=False, capture_output=True, text=True
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            return "the Blender that was to draw it " + (
                f"took more than {SECONDS} s" if isinstance(error, subprocess.TimeoutExpired) else f"failed: {error}"
            )
        raw = read_file(picture)
    if raw is None:
        last = [line for line in (done.stderr or done.stdout).strip().splitlines() if line.strip()][-1:]
        return "Cycles did not draw it: " + "".join(last or ["no reason given"])
    return Texels(raw)


def _blender() -> list[str]:
    """The command of another Blender like this one, which runs a script and no other."""
    if bpy.app.module:
        return [sys.executable, str(SCRIPT)]
    plain = ["--background", "--factory-startup", "--disable-autoexec", "-noaudio", "--python-exit-code", "1"]
    return [bpy.app.binary_path, *plain, "--python", str(SCRIPT)]
