# SPDX-License-Identifier: GPL-3.0-or-later
"""The locks on the rooms: who may import whom. ruff's banned-api says the same at the desk, with a message."""

from __future__ import annotations

import ast
import subprocess
import sys
import textwrap
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "hybrid_addon"
PURE = (
    "accelerated",
    "clock",
    "memory",
    "scene",
    "settings_table",
    "expressions",
    "procedural",
    "programs",
    "tracer",
    "compositor",
    "report",
    "measure",
)
LONGEST_FILE = 350
BLENDER_MODULES = ("bpy", "mathutils", "gpu", "bmesh", "bl_ui", "bpy_extras", "addon_utils")

# Room: the rooms that it must never import. "" is the front hall, which may only be asked lazily, by name.
FORBIDDEN = {
    "scene": {"tracer", "compositor", "report", "measure", "blender"},
    "tracer": {"compositor", "report", "measure", "blender"},
    "compositor": {"tracer", "report", "measure", "blender"},
    "report": {"measure", "blender"},
    "measure.error_time": {"blender"},
    "measure.stability": {"compositor", "blender"},
    "blender.sync": {"tracer", "compositor", "report", "measure"},
}  # fmt: skip

# Who measures the product loads when asked for: only these verbs open that wing.
MEASURED_BY = ("blender.measure", "blender.cli.report", "blender.cli.stability", "measure")

# The floors of a house, lowest first: a room imports from floors below its own only.
FLOORS = {
    "tracer": (
        {"core"}, {"geometry", "materials", "parallel"}, {"emitters", "film", "media"}, {"kernels"},
        {"prepare"}, {"shading"}, {"integrator"}, {"sampling"}, {"catcher"}, {"render"},
    ),
    "blender": (
        {"errors", "gltf", "instancing", "view_layers"}, {"files", "flags", "lines"}, {"sync"}, {"session"},
        {"pipeline"}, {"render"}, {"preview", "scan"}, {"api"}, {"ui", "measure"}, {"cli", "handlers"},
        {"registration"}, {"standalone"},
    ),
}  # fmt: skip


def imported(source: str, module: str, is_package: bool = False) -> Iterator[str]:
    """Every module that this source may import, absolute: `from .a import b` counts as a and as a.b."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parts = module.split(".")
            base = parts[: len(parts) - node.level + is_package] if node.level else []
            path = ".".join([*base, *([node.module] if node.module else [])])
            yield path
            yield from (f"{path}.{alias.name}" for alias in node.names)


def in_room(module: str, room: str) -> bool:
    """Whether a module of the package belongs to this room (`tracer.accel` to `tracer`)."""
    return f"{module}.".startswith(f"hybrid_addon.{room}.")


def modules() -> list[tuple[str, str, bool]]:
    """Name, source and is-a-package of every file of the package."""
    found = []
    for path in sorted(PACKAGE.rglob("*.py")):
        is_package = path.name == "__init__.py"
        relative = path.parent if is_package else path.with_suffix("")
        name = ".".join(relative.relative_to(ROOT).parts)
        found.append((name, path.read_text(encoding="utf-8"), is_package))
    return found


def wrong_arrows(name: str, source: str, is_package: bool = False) -> set[str]:
    """What this module imports and must not, by the table above."""
    targets = set(imported(source, name, is_package))
    return {
        target
        for room, banned in FORBIDDEN.items()
        if in_room(name, room)
        for target in targets
        if any(in_room(target, other) for other in banned)
    }


def test_no_arrow_points_the_wrong_way() -> None:
    wrong = {name: bad for name, source, is_package in modules() if (bad := wrong_arrows(name, source, is_package))}
    assert not wrong


def rooms_of(house: str, module: str) -> str:
    """The room of that house which a module lies in, or "" for another house or the house's own front."""
    start = f"hybrid_addon.{house}."
    return module.removeprefix(start).split(".")[0] if module.startswith(start) else ""


def climbs(house: str, found: Iterable[tuple[str, str, bool]]) -> set[tuple[str, str]]:
    """Pairs of rooms of a house of which the first imports the second, from its own floor or a higher one."""
    floor = {room: number for number, rooms in enumerate(FLOORS[house]) for room in rooms}
    return {
        (mine, other)
        for name, source, is_package in found
        if (mine := rooms_of(house, name))
        for target in imported(source, name, is_package)
        if (other := rooms_of(house, target)) in floor and other != mine and floor[other] >= floor[mine]
    }


@pytest.mark.parametrize("house", FLOORS)
def test_arrows_point_down(house: str) -> None:
    assert not climbs(house, modules())


@pytest.mark.parametrize("house", FLOORS)
def test_every_room_has_its_floor(house: str) -> None:
    known = {room for rooms in FLOORS[house] for room in rooms}
    there = {path.stem for path in (PACKAGE / house).iterdir() if path.suffix == ".py" or any(path.glob("*.py"))}
    assert there - {"__init__", "__pycache__"} == known


def test_the_floors_catch_an_arrow_upwards() -> None:
    up = ("hybrid_addon.tracer.core.rays", "from ..shading.direct import direct_light", False)
    assert climbs("tracer", [up]) == {("core", "shading")}


def test_a_house_has_few_rooms() -> None:
    there = [p for p in (PACKAGE / "tracer").iterdir() if not p.name.startswith("__")]
    assert len(there) <= 14


def test_who_measures_loads_when_asked_for() -> None:
    for name, source, is_package in modules():
        if not any(in_room(name, room) for room in MEASURED_BY):
            assert not [t for t in imported(source, name, is_package) if in_room(t, "measure")], name


def test_only_emitters_know_which_lights_there_are() -> None:
    """A new light is one file there: the rest of the tracer asks the interface (`emitters.light`)."""
    kinds = {f"hybrid_addon.scene.{kind}Light" for kind in ("Point", "Spot", "Sun", "Area")}
    knows = {name for name, source, is_package in modules() if kinds & set(imported(source, name, is_package))}
    assert not [name for name in knows if in_room(name, "tracer") and not in_room(name, "tracer.emitters")]
    assert "hybrid_addon.tracer.emitters.sun_light" in knows


def test_no_file_is_too_long_to_read() -> None:
    long = {name: n for name, source, _ in modules() if (n := source.count("\n")) > LONGEST_FILE}
    assert not long


@pytest.mark.parametrize(
    ("module", "is_package", "line", "target"),
    [
        ("hybrid_addon.tracer.film", False, "from ..compositor import shade", "hybrid_addon.compositor"),
        ("hybrid_addon.tracer", True, "from .. import compositor", "hybrid_addon.compositor"),
        ("hybrid_addon.compositor", False, "from .tracer.film import Film", "hybrid_addon.tracer.film"),
        ("hybrid_addon.scene", True, "def f():\n    from .. import tracer", "hybrid_addon.tracer"),
        ("hybrid_addon.blender.sync.mesh", False, "from ...tracer import trace", "hybrid_addon.tracer"),
        (
            "hybrid_addon.report",
            True,
            "import hybrid_addon.blender.render.images",
            "hybrid_addon.blender.render.images",
        ),
    ],
)
def test_the_lock_catches_each_wrong_arrow(module: str, is_package: bool, line: str, target: str) -> None:
    assert target in wrong_arrows(module, line, is_package)


def test_the_package_imports_itself_relatively_only() -> None:
    """An installed extension is named bl_ext.<repository>.hybrid_addon: the plain name is someone else's."""
    absolute = [
        f"{name}: {ast.unparse(node)}"
        for name, source, _ in modules()
        for node in ast.walk(ast.parse(source))
        if (isinstance(node, ast.Import) and any(a.name.split(".")[0] == "hybrid_addon" for a in node.names))
        or (isinstance(node, ast.ImportFrom) and not node.level and (node.module or "").split(".")[0] == "hybrid_addon")
    ]
    assert not absolute


@pytest.mark.parametrize("room", PURE)
def test_a_pure_room_needs_no_blender(room: str) -> None:
    """Import the whole room in a fresh process in which every module of Blender refuses to load."""
    script = f"""
        import importlib, pkgutil, sys
        class Blocked:
            def find_spec(self, name, path=None, target=None):
                if name.split(".")[0] in {BLENDER_MODULES}:
                    raise ImportError(f"{{name}} is locked out of hybrid_addon.{room}")
        sys.meta_path.insert(0, Blocked())
        sys.path.insert(0, {str(ROOT)!r})
        module = importlib.import_module("hybrid_addon.{room}")
        for info in pkgutil.walk_packages(getattr(module, "__path__", []), module.__name__ + "."):
            importlib.import_module(info.name)
        assert not set({BLENDER_MODULES}) & set(sys.modules)
        assert not [name for name in sys.modules if name.startswith("hybrid_addon.blender")]
    """
    process = subprocess.run([sys.executable, "-c", textwrap.dedent(script)], capture_output=True, text=True)
    assert process.returncode == 0, process.stderr


def test_ruff_bans_the_same_modules() -> None:
    ruff = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["ruff"]["lint"]
    assert "TID251" in ruff["select"]
    assert set(ruff["flake8-tidy-imports"]["banned-api"]) == {"bpy", "mathutils", "embreex", "numba"}
    exempt = {pattern for pattern, codes in ruff["per-file-ignores"].items() if "TID251" in codes}
    inside = {pattern for pattern in exempt if pattern.startswith("hybrid_addon/")}
    assert inside == {
        "hybrid_addon/blender/*",
        "hybrid_addon/blender/ui/{panels,render_panels,presets,messages,operators,advice,cameras}.py",
        "hybrid_addon/blender/ui/image_editor/{picker,editor_panels}.py",
        "hybrid_addon/tracer/geometry/embree/*",
        "hybrid_addon/tracer/kernels/*",
    }
