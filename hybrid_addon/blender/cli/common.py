# SPDX-License-Identifier: GPL-3.0-or-later
"""What every verb of the command needs: its words, opening a file, saying a line, and checks of what it may write."""

from __future__ import annotations

import argparse
import os
import re
import sys
import unicodedata
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NoReturn

import bpy

from ..errors import HybridError

COMMAND = "hybrid"
Verbs = Any  # argparse has no public name for what add_subparsers returns


def open_file(path: Path) -> bpy.types.Scene:
    """Open a .blend. Scripts in it do not run: files are untrusted."""
    if not path.is_file():
        raise HybridError(f"no file '{path}'")
    try:
        bpy.ops.wm.open_mainfile(filepath=str(path.resolve()), load_ui=False, use_scripts=False)
    except RuntimeError as error:
        raise HybridError(f"cannot open '{path}': {_first_line(error)}") from error
    return bpy.context.scene


def check_outputs(paths: Sequence[Path], *folders: Path) -> None:
    """Make the folders, and find out before the work, not after it, that its result cannot be written."""
    for folder in folders:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise HybridError(f"cannot make folder '{folder}': {error.strerror}") from error
    for parent in {path.resolve().parent for path in paths} | {folder.resolve() for folder in folders}:
        if not parent.is_dir():
            raise HybridError(f"cannot write into '{parent}': there is no such folder")
        if not os.access(parent, os.W_OK):
            raise HybridError(f"cannot write into '{parent}': permission denied")


def _first_line(error: Exception) -> str:
    return str(error).strip().splitlines()[0].removeprefix("Error: ")


def say(text: str, stream: Any = None, prefix: str = f"{COMMAND}: ") -> None:
    """Print one line. Names in a file may hold anything: what would end the line or steer a terminal is escaped."""
    stream = stream or sys.stdout
    encoding = getattr(stream, "encoding", None) or "utf-8"
    line = "".join(c if unicodedata.category(c) not in _UNSEEN else ascii(c)[1:-1] for c in text)
    stream.write(f"{prefix}{line}\n".encode(encoding, "backslashreplace").decode(encoding))
    stream.flush()


_UNSEEN = {"Cc", "Cf", "Cs", "Zl", "Zp"}  # control, format (bidirectional marks), lone surrogates, line separators


# ------------------------------------------------------------------------------------------------ words


class Parser(argparse.ArgumentParser):
    """Usage errors in one line, like every other error."""

    def error(self, message: str) -> NoReturn:
        """One line, exit code 2."""
        say(f"error: {message} (see '{self.prog} --help')", sys.stderr)
        raise SystemExit(2)


def number(low: float, high: float, kind: Callable[[str], Any] = float) -> Callable[[str], Any]:
    """A number between two bounds; NaN is in no range."""

    def convert(text: str) -> Any:
        try:
            value = kind(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"'{text}' is not a number") from None
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text} must lie between {low:g} and {high:g}")
        return value

    return convert


def resolution(text: str) -> tuple[int, int]:
    """WIDTHxHEIGHT."""
    match = re.fullmatch(r"(\d{1,5})x(\d{1,5})", text)
    if not match or not all(4 <= int(n) <= 65536 for n in match.groups()):
        raise argparse.ArgumentTypeError(f"'{text}' is not WIDTHxHEIGHT in pixels, 4 to 65536 each")
    return int(match[1]), int(match[2])


def picture(text: str) -> Path:
    """A file that we can write, by its extension."""
    if Path(text).suffix.lower() not in {".png", ".exr"}:
        raise argparse.ArgumentTypeError(f"'{text}' must end in .png or .exr")
    return Path(text)
