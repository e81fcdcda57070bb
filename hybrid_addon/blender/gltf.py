# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender's glTF importer leaves out and the tracer can draw: KHR_materials_dispersion.

The importer asks every add-on for a class `glTF2ImportUserExtension` and calls its hooks.
"""

from __future__ import annotations

import math
from typing import Any

import bpy

DISPERSION = "KHR_materials_dispersion"


class ImportExtension:
    """Hooks of the importer. An exception in one would be a line in its log, and nothing else."""

    def gather_import_material_after_hook(
        self, gltf_material: Any, _vertex_color: Any, b_material: bpy.types.Material, _gltf: Any
    ) -> None:
        """Keep a material's dispersion, 20 / Abbe number."""
        found = (gltf_material.extensions or {}).get(DISPERSION, {})
        value = float(found.get("dispersion", 0.0))
        if math.isfinite(value) and value > 0.0:
            b_material.hybrid.dispersion = value
