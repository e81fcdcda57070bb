"""The `hybrid` command: one parser behind `blender -c hybrid VERB ...` and `python -m hybrid_addon VERB ...`.

Exit codes: 0 done; 2 bad input, named in one line; 1 a failure in the work. Outputs appear whole or not at all.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import sys
import traceback
from collections.abc import Callable, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NoReturn

import bpy

from . import api, images
from .errors import HybridError

COMMAND = "hybrid"
_handle: object | None = None


def register() -> None:
    """Add the command to Blender."""
    global _handle
    _handle = bpy.utils.register_cli_command(COMMAND, main)


def unregister() -> None:
    """Remove the command."""
    global _handle
    if _handle is not None:
        bpy.utils.unregister_cli_command(_handle)
        _handle = None


def main(argv: Sequence[str]) -> int:
    """Run one verb; returns the exit code."""
    try:
        arguments = _parser().parse_args(list(argv))
        arguments.verb(arguments)
    except HybridError as error:
        _say(f"error: {error}", sys.stderr)
        return 2
    except SystemExit as error:  # argparse: --help (0) or usage (2)
        return int(error.code or 0)
    except KeyboardInterrupt:
        _say("cancelled", sys.stderr)
        return 1
    except RuntimeError as error:  # Blender's render operator: one line says it
        _say(f"failed: {error}", sys.stderr)
        return 1
    except Exception:  # a bug of ours: the traceback is what a bug report needs
        traceback.print_exc()
        return 1
    return 0


# ------------------------------------------------------------------------------------------------ render


def _render(arguments: argparse.Namespace) -> None:
    outputs = [path for path in (arguments.output, arguments.report) if path]
    _check_outputs(outputs, arguments.passes)
    scene = _open(arguments.file)
    _mark(scene, arguments)
    frames = [arguments.frame if arguments.frame is not None else scene.frame_current]
    if arguments.animation:
        frames = list(range(scene.frame_start, scene.frame_end + 1, scene.frame_step))
    reports = []
    for frame in frames:
        result = api.render(
            scene,
            frame=frame,
            mode=arguments.mode,
            samples=arguments.samples,
            max_depth=arguments.max_depth,
            light_falloff=arguments.light_falloff,
            resolution=arguments.resolution,
            threads=arguments.threads,
        )
        path = _frame_path(arguments.output, frame) if arguments.animation else arguments.output
        images.write_render_result(path, scene)
        if arguments.passes:
            _write_passes(arguments.passes, result, f"_{frame:04d}" if arguments.animation else "")
        reports.append({**result.report, "output": str(path)})
        for warning in result.report["warnings"]:
            _say(f"warning: {warning}")
        seconds = result.report["time"]["total"]["wall"]
        _say(f"frame {frame}: {path} ({seconds:.2f} s, {result.report['mask_coverage'] * 100:.1f} % ray traced)")
    if arguments.report:
        whole = {"schema": reports[0]["schema"], "frames": reports} if arguments.animation else reports[0]
        with images.atomic(arguments.report) as temporary:
            Path(temporary).write_text(json.dumps(whole, indent=1), encoding="utf-8")


def _mark(scene: bpy.types.Scene, arguments: argparse.Namespace) -> None:
    """Flag the named objects, with the values given; values without names go to all objects that are flagged."""
    values = {name: getattr(arguments, name) for name in ("reflectivity", "opacity", "ior")}
    if arguments.ray_traced:
        for b_object in scene.objects:
            b_object.hybrid.ray_traced = False
        chosen = [_find_object(scene, name) for name in arguments.ray_traced]
    else:
        given = any(value is not None for value in values.values())
        chosen = [ob for ob in scene.objects if ob.hybrid.ray_traced] if given else []
        if given and not chosen:
            raise HybridError("no object is ray traced: name some with --ray-traced")
    for b_object in chosen:
        api.mark(b_object, **values)


def _find_object(scene: bpy.types.Scene, name: str) -> bpy.types.Object:
    b_object = scene.objects.get(name)
    if b_object is None:
        close = get_close_matches(name, [ob.name for ob in scene.objects], n=1)
        hint = f"; did you mean '{close[0]}'?" if close else ""
        raise HybridError(f"no object '{name}' in scene '{scene.name}'{hint}")
    return b_object


def _write_passes(folder: Path, result: api.HybridResult, suffix: str) -> None:
    for name in ("raster", "mask", "traced"):
        images.write_exr(folder / f"{name}{suffix}.exr", getattr(result, name))


def _frame_path(path: Path, frame: int) -> Path:
    """shot.png -> shot0001.png; shot_###.png -> shot_001.png (Blender's own rule)."""
    hashes = re.search(r"#+", path.name)
    if hashes:
        name = path.name[: hashes.start()] + f"{frame:0{len(hashes.group())}d}" + path.name[hashes.end() :]
        return path.with_name(name)
    return path.with_name(f"{path.stem}{frame:04d}{path.suffix}")


# ------------------------------------------------------------------------------------------------ plan


def _plan(arguments: argparse.Namespace) -> None:
    scene = _open(arguments.file)
    plan = api.plan(scene)
    if arguments.json:
        _say(json.dumps(plan, indent=1), prefix="")
        return
    lines = [
        f"scene {plan['scene']}: mode {plan['mode'].lower()}" + (f" ({plan['why']})" if plan["why"] else ""),
        "ray traced: " + (", ".join(plan["ray_traced"]) or "nothing"),
        "settings: " + ", ".join(f"{name} {value}" for name, value in plan["settings"].items()),
        "counts: " + ", ".join(f"{name} {value}" for name, value in plan["counts"].items()),
        *(f"left out: {item['what']}: {item['why']}" for item in plan["skipped"]),
        *(f"warning: {warning}" for warning in plan["warnings"]),
    ]
    for line in lines:
        _say(line, prefix="")


# ------------------------------------------------------------------------------------------------ stability


def _stability(arguments: argparse.Namespace) -> None:
    from . import stability  # it imports the tracer: a missing library must not keep Blender from loading the add-on

    stability.choose(arguments.only)  # a name that is not there: found out before a folder is made
    _check_outputs([], arguments.output)
    failed = stability.write(arguments.output, arguments.only, lambda text: _say(text, prefix=""))
    if failed:
        some = "1 case is not within its" if failed == 1 else f"{failed} cases are not within their"
        raise RuntimeError(f"{some} tolerance")


# ------------------------------------------------------------------------------------------------ checks


def _open(path: Path) -> bpy.types.Scene:
    """Open a .blend. Scripts in it do not run: files are untrusted."""
    if not path.is_file():
        raise HybridError(f"no file '{path}'")
    try:
        bpy.ops.wm.open_mainfile(filepath=str(path.resolve()), load_ui=False, use_scripts=False)
    except RuntimeError as error:
        raise HybridError(f"cannot open '{path}': {_first_line(error)}") from error
    return bpy.context.scene


def _check_outputs(paths: Sequence[Path], folder: Path | None) -> None:
    """Find out before the work, not after it, that its result cannot be written."""
    if folder is not None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise HybridError(f"cannot make folder '{folder}': {error.strerror}") from error
    for parent in {path.resolve().parent for path in paths} | ({folder.resolve()} if folder else set()):
        if not parent.is_dir():
            raise HybridError(f"cannot write into '{parent}': there is no such folder")
        if not os.access(parent, os.W_OK):
            raise HybridError(f"cannot write into '{parent}': permission denied")


def _first_line(error: Exception) -> str:
    return str(error).strip().splitlines()[0].removeprefix("Error: ")


def _say(text: str, stream: Any = None, prefix: str = f"{COMMAND}: ") -> None:
    stream = stream or sys.stdout
    stream.write(f"{prefix}{text}\n")
    stream.flush()


# ------------------------------------------------------------------------------------------------ the parser


class _Parser(argparse.ArgumentParser):
    """Usage errors in one line, like every other error."""

    def error(self, message: str) -> NoReturn:
        _say(f"error: {message} (see '{self.prog} --help')", sys.stderr)
        raise SystemExit(2)


def _number(low: float, high: float, kind: Callable[[str], Any] = float) -> Callable[[str], Any]:
    def convert(text: str) -> Any:
        try:
            value = kind(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"'{text}' is not a number") from None
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text} must lie between {low:g} and {high:g}")
        return value

    return convert


def _resolution(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{1,5})x(\d{1,5})", text)
    if not match or not all(4 <= int(n) <= 65536 for n in match.groups()):
        raise argparse.ArgumentTypeError(f"'{text}' is not WIDTHxHEIGHT in pixels, 4 to 65536 each")
    return int(match[1]), int(match[2])


def _picture(text: str) -> Path:
    if Path(text).suffix.lower() not in {".png", ".exr"}:
        raise argparse.ArgumentTypeError(f"'{text}' must end in .png or .exr")
    return Path(text)


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog=COMMAND, description="EEVEE draws the world, a ray tracer draws the objects you flag.")
    verbs = parser.add_subparsers(metavar="VERB", required=True, parser_class=_Parser)

    render = verbs.add_parser("render", help="render a .blend hybrid")
    render.set_defaults(verb=_render)
    render.add_argument("file", type=Path, metavar="FILE")
    render.add_argument("--output", type=_picture, required=True, metavar="PATH", help="PNG or EXR, by its extension")
    when = render.add_mutually_exclusive_group()
    when.add_argument(
        "--frame", type=_number(-1048574, 1048574, int), metavar="N", help="default: the file's current frame"
    )
    when.add_argument(
        "--animation", action="store_true", help="the file's frame range; #### in PATH is the frame number"
    )
    render.add_argument("--mode", choices=("hybrid", "raster", "full"), help="default: the file's own")
    render.add_argument("--ray-traced", nargs="+", metavar="NAME", help="flag these objects instead of the file's")
    render.add_argument("--reflectivity", type=_number(0, 1), metavar="X", help="of the ray traced objects, 0..1")
    render.add_argument("--opacity", type=_number(0, 1), metavar="X", help="of the ray traced objects, 0..1")
    render.add_argument("--ior", type=_number(1e-6, 1e6), metavar="X", help="of the ray traced objects")
    render.add_argument(
        "--samples", type=_number(1, 65536, int), metavar="N", help="rays through each ray traced pixel"
    )
    render.add_argument("--max-depth", type=_number(0, 1024, int), metavar="N", help="bounces")
    render.add_argument("--light-falloff", choices=("eevee", "physical"), help="default: the file's own")
    render.add_argument("--resolution", type=_resolution, metavar="WxH")
    render.add_argument("--threads", type=_number(0, 1024, int), metavar="N", help="0: all cores")
    render.add_argument(
        "--report", type=Path, metavar="PATH.json", help="what was done, what it cost, what was left out"
    )
    render.add_argument("--passes", type=Path, metavar="DIR", help="also write raster, mask and traced as EXR")

    plan = verbs.add_parser("plan", help="say what would be traced and what is left out; traces nothing")
    plan.set_defaults(verb=_plan)
    plan.add_argument("file", type=Path, metavar="FILE")
    plan.add_argument("--json", action="store_true", help="as JSON")

    table = verbs.add_parser("stability", help="run the stiff and extreme cases: value, tolerance, pass")
    table.set_defaults(verb=_stability)
    table.add_argument(
        "--output", type=Path, required=True, metavar="DIR", help="for stability.html and stability.json"
    )
    table.add_argument("--only", nargs="+", default=[], metavar="NAME", help="these cases or themes only")
    return parser
