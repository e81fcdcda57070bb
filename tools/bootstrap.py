# SPDX-License-Identifier: GPL-3.0-or-later
"""Sets up the development environment: a virtual environment with tools/requirements.txt in it.

Run as ``PYTHON tools/bootstrap.py .venv``. Does nothing when that is done already and the requirements are the same.
Versions are those of tools/constraints-3.x.txt; what these do not name is as new as the requirements allow.
With INSTALL_SYSTEM_PACKAGES=1 (CI, as root on Debian) it also installs the shared libraries that bpy needs.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import subprocess
import sys
from pathlib import Path

TOOLS = Path(__file__).resolve().parent
REQUIREMENTS = TOOLS / "requirements.txt"
VERSIONS = {(3, 13): "Blender 5.2 LTS", (3, 11): "Blender 4.5 LTS"}
# What bpy links to or opens by name and a server may lack, with the Debian package that has it.
LIBRARIES = {
    "libX11.so.6": "libx11-6",
    "libXrender.so.1": "libxrender1",
    "libXfixes.so.3": "libxfixes3",
    "libXi.so.6": "libxi6",
    "libXext.so.6": "libxext6",
    "libxkbcommon.so.0": "libxkbcommon0",
    "libSM.so.6": "libsm6",
    "libICE.so.6": "libice6",
    "libGL.so.1": "libgl1",
    "libEGL.so.1": "libegl1",
}


def main(folder: Path) -> None:
    """Make the environment whole, or say in one line what is missing."""
    major_minor = sys.version_info[:2]
    version = "{}.{}".format(*major_minor)
    if major_minor not in VERSIONS:
        wanted = " or ".join("{}.{} ({})".format(*known, name) for known, name in VERSIONS.items())
        sys.exit(f"Blender's module needs Python {wanted}; {sys.executable} is {version}")
    packages = missing_packages()
    if packages and os.environ.get("INSTALL_SYSTEM_PACKAGES") == "1":
        run("apt-get", "update", "-q")
        run("apt-get", "install", "-y", "-q", "--no-install-recommends", *packages)
    elif packages:
        sys.exit("Blender's module needs system libraries: sudo apt-get install " + " ".join(packages))
    constraints = TOOLS / f"constraints-{version}.txt"
    recipe = version + " " + hashlib.sha256(REQUIREMENTS.read_bytes() + constraints.read_bytes()).hexdigest()
    stamp = folder / "set-up-stamp.txt"
    if stamp.exists() and stamp.read_text(encoding="utf-8") == recipe:
        return
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    same = f"import sys; sys.exit(sys.version_info[:2] != {major_minor})"
    if python.exists() and subprocess.run([str(python), "-c", same]).returncode:
        sys.exit(f"{folder} is of another Python than {version}: name another folder with VENV=")
    print(f"Setting up {folder} with {VERSIONS[major_minor]} (once, some minutes)", flush=True)
    if not python.exists() or subprocess.run([str(python), "-m", "pip", "-V"], capture_output=True).returncode:
        run(sys.executable, "-m", "venv", "--clear", folder)  # there is none, or a set-up was interrupted
    pip = (python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check")
    run(*pip, "-r", REQUIREMENTS, "-c", constraints)
    run(python, "-c", "import bpy, embreex, OpenImageIO")
    stamp.write_text(recipe, encoding="utf-8")


def missing_packages() -> list[str]:
    """Debian's names of the packages that hold the shared libraries this machine lacks."""
    missing = []
    for library, package in LIBRARIES.items() if sys.platform == "linux" else ():
        try:
            ctypes.CDLL(library)
        except OSError:
            missing.append(package)
    return missing


def run(*command: object) -> None:
    """Run one step of the set-up; its own last words are the message when it fails."""
    if subprocess.run([str(part) for part in command]).returncode:
        sys.exit("Failed: " + " ".join(str(part) for part in command))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
