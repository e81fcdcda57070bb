"""The locks on the rooms: who may import whom. ruff's banned-api says the same at the desk, with a message."""

from __future__ import annotations

import ast
import subprocess
import sys
import textwrap
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "hybrid_addon"
PURE = ("clock", "scene", "expressions", "procedural", "tracer", "compositor", "report", "stability")
BLENDER_MODULES = ("bpy", "mathutils", "gpu", "bmesh", "bl_ui", "bpy_extras", "addon_utils")

# Room: the rooms that it must never import. "" is the front hall, which may only be asked lazily, by name.
FORBIDDEN = {
    "scene": {"tracer", "compositor", "report", "stability", "blender"},
    "tracer": {"compositor", "report", "stability", "blender"},
    "compositor": {"tracer", "report", "stability", "blender"},
    "report": {"blender"},
    "stability": {"compositor", "blender"},
    "blender.sync": {
        "tracer", "compositor", "report",
        "blender.pipeline", "blender.engine", "blender.ui", "blender.operators", "blender.cli",
    },
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


@pytest.mark.parametrize(
    ("module", "is_package", "line", "target"),
    [
        ("hybrid_addon.tracer.film.filter", False, "from ..compositor import over", "hybrid_addon.compositor"),
        ("hybrid_addon.tracer", True, "from .. import compositor", "hybrid_addon.compositor"),
        ("hybrid_addon.compositor", False, "from .tracer.film import Film", "hybrid_addon.tracer.film.filter"),
        ("hybrid_addon.scene", False, "def f():\n    from . import tracer", "hybrid_addon.tracer"),
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
    assert set(ruff["flake8-tidy-imports"]["banned-api"]) == {"bpy", "mathutils", "embreex"}
    exempt = {pattern for pattern, codes in ruff["per-file-ignores"].items() if "TID251" in codes}
    inside = {pattern for pattern in exempt if pattern.startswith("hybrid_addon/")}
    assert inside == {
        "hybrid_addon/blender/*",
        "hybrid_addon/blender/ui/{panels,operators,advice,picker}.py",
        "hybrid_addon/tracer/geometry/embree.py",
    }
