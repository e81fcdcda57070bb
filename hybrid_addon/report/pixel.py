# SPDX-License-Identifier: GPL-3.0-or-later
"""A pixel's ray tree as text, for people."""

from __future__ import annotations

from ..scene import Scene
from ..tracer.integrator.explain import Node


def pixel_text(scene: Scene, root: Node, x: int, y: int) -> str:
    """Lines that say what the ray through the centre of pixel (x, y) met, and what each part brought."""
    head = f"pixel {x}, {y}: "
    if not root.counts:
        return head + "no ray traced object here; EEVEE draws it"
    total, lost = _total(root), _lost(root)
    lines = [f"{head}radiance {_color(total)}" + (f"; cut off, of unit radiance: {lost:.2g}" if lost else "")]
    _add_lines(lines, scene, root, "", "")
    return "\n".join(lines)


def _add_lines(lines: list[str], scene: Scene, node: Node, first: str, rest: str) -> None:
    lines.append(first + _line(scene, node))
    for number, child in enumerate(node.children):
        last = number == len(node.children) - 1
        _add_lines(lines, scene, child, rest + ("└ " if last else "├ "), rest + ("  " if last else "│ "))


def _line(scene: Scene, node: Node) -> str:
    share = max(node.throughput)
    what = f"{node.kind} {share * 100:.3g} %"
    if node.cut:
        return f"{what}: not followed"
    if node.lamps:
        what += ", past " + ", ".join(f"light '{name}'" for name in node.lamps)
    if node.fog != 1.0:
        what += f", through fog that leaves {node.fog * 100:.3g} %"
    if node.object < 0:
        return f"{what}: the world, {_color(node.adds)}"
    side = "from inside" if node.inside else "from outside"
    where = f"{what}: {node.distance:.4g} m to {_object(scene, node.object)}, {_surface(scene, node.surface)}"
    return f"{where}, {side} at {node.angle:.1f}°" + (f", adds {_color(node.adds)}" if any(node.adds) else "")


def _object(scene: Scene, number: int) -> str:
    names = [shape.name for shapes in (scene.instances, scene.spheres, scene.planes) for shape in shapes]
    return f"'{names[number]}'"


def _surface(scene: Scene, number: int) -> str:
    return f"surface '{scene.surfaces[number].name}'"


def _color(rgb: tuple[float, float, float]) -> str:
    return " ".join(f"{v:.4g}" for v in rgb)


def _total(node: Node) -> tuple[float, float, float]:
    sums = [node.adds, *(_total(child) for child in node.children)]
    return (sum(s[0] for s in sums), sum(s[1] for s in sums), sum(s[2] for s in sums))


def _lost(node: Node) -> float:
    return sum(max(c.throughput) if c.cut else _lost(c) for c in node.children)
