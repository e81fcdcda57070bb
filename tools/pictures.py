# SPDX-License-Identifier: GPL-3.0-or-later
"""`make pictures`: makes every picture in docs/ anew, by the programs that show what is on them.

python tools/pictures.py [PICTURE ...]

The Image Editor and the panels are drawn by the real Blender of the checks (BLENDER, XVFB_BLENDER), at work there as an
artist is. Look at what comes out: nothing else does.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUILD = ROOT / "build" / "pictures"
REAL = BUILD / "real"
CHECKS = ["tools/run_tests.py", "-q", "tests/real_blender/checks.py", "--basetemp", str(REAL), "-k"]

PICTURES: dict[str, tuple[list[str], Path]] = {
    "hybrid.png": (["tools/demo.py", "--output", str(BUILD / "demo")], BUILD / "demo" / "hybrid.png"),
    "slots.png": (["tools/slots_picture.py", str(BUILD / "slots.png")], BUILD / "slots.png"),
    "denoise.png": (["tools/denoise_picture.py", str(BUILD / "denoise.png")], BUILD / "denoise.png"),
    "surface_programs.png": (
        ["tools/programs_picture.py", str(BUILD / "surface_programs.png")],
        BUILD / "surface_programs.png",
    ),
    "panels.png": ([*CHECKS, "panels"], REAL / "real0" / "panels.png"),
    "panels_german.png": ([*CHECKS, "panels"], REAL / "real0" / "panels_german.png"),
    "image_editor.png": ([*CHECKS, "first_hour"], REAL / "real0" / "artist" / "pixel.png"),
}
"""Name in docs/ -> what makes it, and where."""


def main() -> int:
    """Make them, one after the other; 2 for a name that is none, 1 for a program that failed: its picture stays."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("pictures", nargs="*", metavar="PICTURE", help=f"some of: {', '.join(PICTURES)} (all)")
    arguments = parser.parse_args()
    unknown = [name for name in arguments.pictures if name not in PICTURES]
    if unknown:
        parser.error(f"no picture '{unknown[0]}': choose from {', '.join(PICTURES)}")
    BUILD.mkdir(parents=True, exist_ok=True)
    failed = 0
    for name in arguments.pictures or PICTURES:
        command, made = PICTURES[name]
        made.unlink(missing_ok=True)
        ended = subprocess.run([sys.executable, *command], cwd=ROOT).returncode
        if ended or not made.exists():
            print(f"docs/{name} stays as it is: {' '.join(command)} failed")
            failed += 1
            continue
        shutil.copyfile(made, ROOT / "docs" / name)
        print(f"docs/{name}")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
