# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs in a process of its own with empty user resources: installs the zip, uses the add-on, removes it, reports JSON.

python tests/package_driver.py ZIP REPORT.json
"""

import importlib
import json
import os
import pkgutil
import sys
from pathlib import Path

import bpy

import addon_utils  # isort: skip  (bpy puts it on the path)

MODULE = "bl_ext.user_default.hybrid_addon"
# Blender 5.2 miscounts a scene's users itself when a node group with a Render Layers node is removed; 4.5 keeps a
# scene's embedded node tree for good once there was one (what counts is use_nodes).
NOT_OURS = {"users", "node_tree"}
SIMPLE = {"BOOLEAN", "INT", "FLOAT", "STRING", "ENUM"}
TYPES = ("Object", "Scene", "ViewLayer", "Collection", "Material", "Light", "World", "Camera", "WindowManager")


def rna(struct) -> dict:
    """Every plain property of a Blender struct, and the names of what it points at."""
    found = {}
    for prop in struct.bl_rna.properties:
        value = getattr(struct, prop.identifier, None)
        if prop.identifier in NOT_OURS:
            continue
        if prop.type in SIMPLE:
            found[prop.identifier] = repr(value[:] if getattr(prop, "is_array", False) else value)
        elif prop.type == "POINTER":
            found[prop.identifier] = repr(getattr(value, "name", None))
    return found


def engines() -> str:
    """The render engines, from the complaint about one that does not exist."""
    try:
        bpy.context.scene.render.engine = "NONE_SUCH"
    except TypeError as error:
        return str(error)
    raise AssertionError("an unknown engine was accepted")


def layer_tree(layer) -> dict:
    return {"self": rna(layer), "children": [layer_tree(child) for child in layer.children]}


def snapshot() -> dict:
    """Everything in which an add-on could leave a trace."""
    data = {p.identifier: sorted(d.name for d in getattr(bpy.data, p.identifier))
            for p in bpy.data.bl_rna.properties if p.type == "COLLECTION"}  # fmt: skip
    return {
        "types": sorted(dir(bpy.types)),
        "attributes": {name: sorted(dir(getattr(bpy.types, name))) for name in TYPES},
        "operators": sorted(dir(bpy.ops)),
        "engines": engines(),
        "handlers": {
            name: [f"{f.__module__}.{f.__qualname__}" for f in value]
            for name in dir(bpy.app.handlers)
            if isinstance(value := getattr(bpy.app.handlers, name), list)
        },
        "drawn into": {  # beside the class's own drawing, which Blender lists once anybody has been there
            name: number - 1
            for name in dir(bpy.types)
            if (number := len(getattr(getattr(getattr(bpy.types, name), "draw", None), "_draw_funcs", ()))) > 1
        },
        "data": data,
        "scenes": [
            {
                "scene": rna(scene),
                "render": rna(scene.render),
                "image": rna(scene.render.image_settings),
                "view layers": [(rna(layer), layer_tree(layer.layer_collection)) for layer in scene.view_layers],
                "objects": [rna(obj) for obj in scene.objects],
            }
            for scene in bpy.data.scenes
        ],
    }


def import_everything() -> None:
    """Load every module of the installed package, as rendering would, so that the policy check sees them all."""
    package = importlib.import_module(f"{MODULE}.hybrid_addon")
    for info in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
        if not info.name.endswith("__main__"):
            importlib.import_module(info.name)


def use() -> dict:
    """What an artist's script does: flag an object, switch the scene to hybrid; set up as for the next render."""
    from bl_ext.user_default import hybrid_addon as hybrid

    cube = bpy.context.scene.objects["Cube"]
    hybrid.mark(cube, reflectivity=1.0)
    hybrid.enable(bpy.context.scene)
    importlib.import_module(f"{MODULE}.hybrid_addon.blender.pipeline.scene_setup").sync(bpy.context.scene)
    return {"ray_traced": cube.hybrid.ray_traced, "reflectivity": cube.hybrid.reflectivity,
            "enabled": bpy.context.scene.hybrid.enabled, "layers": len(bpy.context.scene.view_layers)}  # fmt: skip


def main(archive: str, report: str) -> None:
    resources = Path(os.environ["BLENDER_USER_RESOURCES"])
    result = {"before": snapshot()}
    bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
    result["enabled"] = addon_utils.check(MODULE)[1]
    import_everything()
    result["used"] = use()
    result["wheel"] = sorted(str(path.relative_to(resources)) for path in resources.rglob("embreex/__init__.py"))
    result["warnings"] = {key: list(value) for key, value in addon_utils._extensions_warnings_get().items()}
    repos = [repo.module for repo in bpy.context.preferences.extensions.repos]
    bpy.ops.extensions.package_uninstall(repo_index=repos.index("user_default"), pkg_id="hybrid_addon")
    result["after"] = snapshot()
    result["left"] = sorted(str(path.relative_to(resources)) for path in resources.rglob("*hybrid_addon*"))
    result["left"] += sorted(str(path.relative_to(resources)) for path in resources.rglob("embreex"))
    Path(report).write_text(json.dumps(result), encoding="utf-8")


main(*sys.argv[1:])
sys.stdout.flush()
os._exit(0)
