# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m hybrid_addon`: Blender as a Python module, with the add-on registered, running one command."""

from __future__ import annotations

import os
import sys


def main() -> None:
    """Run the command line and leave with its exit code.

    Leaves by os._exit: bpy 4.5's static destructors wait for ever after an EEVEE render.
    """
    try:
        import bpy  # noqa: F401
    except ImportError as error:
        sys.stderr.write(
            f"hybrid: error: the bpy module does not load ({error}): pip install bpy, or use Blender itself\n"
        )
        raise SystemExit(2) from error
    from . import cli, registration

    registration.register()
    code = cli.main(sys.argv[1:])
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)
