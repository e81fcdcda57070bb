# SPDX-License-Identifier: GPL-3.0-or-later
"""Open .blend files of any origin, ask what needs rays, flag it, render hybrid beside EEVEE and Cycles.

python tools/real_files.py FOLDER_OR_FILE ... --output DIR [--width 320] [--samples 4] [--flag NAME ...]

Each file is rendered in a process of its own and must be, byte for byte, what it was before. For each: NAME.png (from
left: EEVEE, hybrid, the whole picture ray traced, Cycles), NAME.json (advice, report), and a line on the terminal.
Exit code 1 if a file fails or changes. Files are untrusted: no script of theirs runs, their File Output nodes are mute.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "tools")]

from leave import leave  # noqa: E402

LIMIT = 900  # seconds for one file
KINDS = ("eevee", "hybrid", "full", "cycles")


def main() -> int:
    """All files, one after the other."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--output", type=Path, required=True)
    parser.add_argument("--width", type=int, default=320)
    parser.add_argument("--samples", type=int, default=4)
    parser.add_argument("--flag", nargs="*", default=[], help="flag these, too, where they are in the file")
    parser.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)  # in the process of one file
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    if arguments.inside:
        _one(arguments.files[0], arguments)
        leave()
    files = [f for path in arguments.files for f in (sorted(path.glob("*.blend")) if path.is_dir() else [path])]
    failed = [f.name for f in files if not _unharmed(f, arguments)]
    print(
        f"{len(files) - len(failed)} of {len(files)} files are well" + (f"; not: {', '.join(failed)}" if failed else "")
    )
    return 1 if failed else 0


def _unharmed(path: Path, arguments: argparse.Namespace) -> bool:
    """Render one file in its own process; whether that went well and left the file as it was."""
    before = _hash(path)
    command = [
        sys.executable, __file__, str(path), "--inside", "--output", str(arguments.output),
        "--width", str(arguments.width), "--samples", str(arguments.samples), "--flag", *arguments.flag,
    ]  # fmt: skip
    try:
        process = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT)
    except subprocess.TimeoutExpired:
        print(f"{path.name}: not done after {LIMIT} s")
        return False
    changed = _hash(path) != before
    said = [line.removeprefix("REAL ") for line in process.stdout.splitlines() if line.startswith("REAL ")]
    print("\n".join([f"{path.name}:" + (" CHANGED" if changed else ""), *(f"  {line}" for line in said)]), flush=True)
    if process.returncode:
        print("  " + "\n  ".join((process.stdout + process.stderr).splitlines()[-12:]))
    return process.returncode == 0 and not changed


def _hash(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


# ------------------------------------------------------------------------------------------------ one file


def _one(path: Path, arguments: argparse.Namespace) -> None:
    import bpy

    import hybrid_addon as hybrid
    from hybrid_addon.blender.pipeline import nodes, scene_setup

    hybrid.register()
    bpy.ops.wm.open_mainfile(filepath=str(path.resolve()), load_ui=False, use_scripts=False)
    scene = bpy.context.scene
    for tree in [*bpy.data.node_groups, *filter(None, map(nodes.compositor_tree, bpy.data.scenes))]:
        for node in tree.nodes:
            node.mute = node.mute or node.bl_idname == "CompositorNodeOutputFile"
    if scene.render.engine == "CYCLES":
        scene.render.engine = scene_setup.eevee()
    height = round(arguments.width * scene.render.resolution_y / scene.render.resolution_x)
    size = arguments.width, max(4, height)
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage, scene.hybrid.samples = 100, arguments.samples
    scene.eevee.taa_render_samples = arguments.samples
    advice = hybrid.advise(scene)
    print(f"REAL {scene.render.engine}, {size[0]} x {size[1]}, {advice['basis']}")
    for entry in advice["objects"]:
        print(f"REAL advice: {_sentence(entry)}")
    chosen = {e["object"] for e in advice["objects"] if e["suggested"]} | set(arguments.flag)
    for b_object in scene.objects:
        if b_object.name in chosen:
            b_object.hybrid.ray_traced = True
    written = _pictures(scene, arguments.output / path.stem, advice)
    _sheet(written, arguments.output / f"{path.stem}.png")


def _pictures(scene: Any, stem: Path, advice: dict[str, Any]) -> list[Path]:
    """The same frame four times; the reports of the traced ones beside them."""
    import bpy

    import hybrid_addon as hybrid
    from hybrid_addon.blender.render import images

    reports, written = {}, []
    for kind in KINDS:
        picture = stem.with_name(f"{stem.name}.{kind}.png")
        if kind == "cycles":
            scene.hybrid.enabled = False
            scene.render.engine, scene.cycles.device = "CYCLES", "CPU"
            scene.cycles.samples, scene.cycles.use_denoising = 32, False
            bpy.ops.render.render(scene=scene.name)
        else:
            mode = "raster" if kind == "eevee" else kind
            reports[kind] = hybrid.render(scene, mode=mode).report
        images.write_render_result(picture, scene)
        written.append(picture)
    for warning in dict.fromkeys(reports["hybrid"]["warnings"]):
        print(f"REAL warning: {warning}")
    hybrid_report, expected = reports["hybrid"], advice["shadows"] + sum(e["seconds"] for e in advice["objects"])
    broken = {name: count for name, count in hybrid_report["invariants"].items() if count} or "none"
    covered, spent = hybrid_report["mask_coverage"] * 100, hybrid_report["time"].get("trace", {}).get("wall", 0.0)
    estimate = f"expected {expected:.2f} s (x {expected / max(spent, 0.01):.2f})"
    print(f"REAL traced {covered:.1f} % in {spent:.2f} s, {estimate}; broken invariants: {broken}")
    stem.with_name(f"{stem.name}.json").write_text(
        json.dumps({"advice": advice, **reports}, indent=1), encoding="utf-8"
    )
    return written


def _sentence(entry: dict[str, Any]) -> str:
    from hybrid_addon.report.advice import sentence

    return sentence(entry)


def _sheet(pictures: list[Path], path: Path) -> None:
    """All pictures in a row; the single ones go."""
    from demo import row

    row(pictures, path)
    for picture in pictures:
        picture.unlink()


if __name__ == "__main__":
    sys.exit(main())
