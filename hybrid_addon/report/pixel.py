# SPDX-License-Identifier: GPL-3.0-or-later
"""A pixel's ray tree as text, for people."""

from __future__ import annotations

from collections.abc import Callable

from ..scene import Scene
from ..tracer.integrator.explain import PARTS, RGB, Node

Say = Callable[[str], str]
"""Puts a word or a template of this file into a language."""


def pixel_text(scene: Scene, root: Node, x: int, y: int, say: Say = str) -> str:
    """Lines that say what the ray through the centre of pixel (x, y) met, and what each part brought."""
    if not root.counts:
        return say("pixel {}, {}: no ray traced object here; EEVEE draws it").format(x, y)
    total, lost = _total(root), _lost(root)
    head = say("pixel {}, {}: radiance {}").format(x, y, _color(total))
    shares = [f"{say(name)} {share * 100:.0f} %" for name in PARTS if (share := _share(root, name, total)) >= 0.005]
    lines = [head + (say("; of it {}").format(", ".join(shares)) if shares else "")]
    if lost:
        lines[0] += say("; cut off, of unit radiance: {}").format(f"{lost:.2g}")
    _add_lines(lines, scene, root, "", "", say)
    return "\n".join(lines)


def _add_lines(lines: list[str], scene: Scene, node: Node, first: str, rest: str, say: Say) -> None:
    lines.append(first + _line(scene, node, say))
    for number, child in enumerate(node.children):
        last = number == len(node.children) - 1
        _add_lines(lines, scene, child, rest + ("└ " if last else "├ "), rest + ("  " if last else "│ "), say)


def _line(scene: Scene, node: Node, say: Say) -> str:
    what = f"{say(node.kind)} {max(node.throughput) * 100:.3g} %"
    if node.cut:
        return what + say(": not followed")
    if node.lamps:
        what += say(", past {}").format(", ".join(say("light {}").format(f"'{name}'") for name in node.lamps))
    if node.fog != 1.0:
        what += say(", through fog that leaves {} %").format(f"{node.fog * 100:.3g}")
    if node.object < 0:
        met = say("it leaves the scene")
    else:
        place = (f"{node.distance:.4g}", _object(scene, node.object), _surface(scene, node.surface))
        met = say("{} m to {}, surface {}").format(*place)
        side = say("from inside at {}°") if node.inside else say("from outside at {}°")
        met += ", " + side.format(f"{node.angle:.1f}")
        if node.program:
            met += say(", answered by surface program {}").format(f"'{node.program}'")
    brought = ", ".join(f"{say(name)} {_color(node.parts[name])}" for name in PARTS if name in node.parts)
    return f"{what}: {met}" + (f"; {brought}" if brought else "")


def _object(scene: Scene, number: int) -> str:
    names = [shape.name for shapes in (scene.instances, scene.spheres, scene.planes) for shape in shapes]
    return f"'{names[number]}'"


def _surface(scene: Scene, number: int) -> str:
    return f"'{scene.surfaces[number].name}'"


def _color(rgb: tuple[float, float, float]) -> str:
    return " ".join(f"{v:.3g}" for v in rgb)


def _sum(values: list[RGB]) -> RGB:
    return (sum(v[0] for v in values), sum(v[1] for v in values), sum(v[2] for v in values))


def _total(node: Node) -> RGB:
    return _sum([node.adds, *(_total(child) for child in node.children)])


def _part(node: Node, name: str) -> RGB:
    """What rays from here on bring of one kind."""
    return _sum([node.parts.get(name, (0.0, 0.0, 0.0)), *(_part(child, name) for child in node.children)])


def _share(root: Node, name: str, total: RGB) -> float:
    """Of the pixel's radiance, all three channels together."""
    return sum(_part(root, name)) / sum(total) if sum(total) > 0 else 0.0


def _lost(node: Node) -> float:
    return sum(max(c.throughput) if c.cut else _lost(c) for c in node.children)
