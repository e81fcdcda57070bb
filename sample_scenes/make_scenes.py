# SPDX-License-Identifier: GPL-3.0-or-later
"""Build the sample scenes and save them beside this file, or into another folder.

    python sample_scenes/make_scenes.py [--output DIR] [NAME ...]

Any Python that has bpy will do; the files in the repository were saved by Blender 4.5, which 5.x also opens.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import bathroom
import cornell
import kit
import still_life
import studio

SCENES = {
    "cornell_box": cornell.cornell_box,
    "simple": still_life.simple,
    "intermediate": still_life.intermediate,
    "complex": bathroom.complex_scene,
    "studio": studio.studio,
}


def main():
    """Build what was asked for; all of them by default."""
    parser = argparse.ArgumentParser(description="Build the sample scenes.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"one of {', '.join(SCENES)}; all by default")
    parser.add_argument("--output", type=Path, default=Path(__file__).resolve().parent, help="folder for the files")
    arguments = parser.parse_args()
    unknown = set(arguments.names) - set(SCENES)
    if unknown:
        parser.error(f"no scene called {', '.join(sorted(unknown))}; there are {', '.join(SCENES)}")
    arguments.output.mkdir(parents=True, exist_ok=True)
    try:
        for name in arguments.names or SCENES:
            path = arguments.output / f"{name}.blend"
            SCENES[name]()
            kit.save(path.resolve())
            print(f"{path}: {sum(kit.triangles().values()):,} triangles, {path.stat().st_size / 1024:.0f} KiB")
    finally:
        kit.finish()


if __name__ == "__main__":
    main()
