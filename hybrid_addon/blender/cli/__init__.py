# SPDX-License-Identifier: GPL-3.0-or-later
"""The `hybrid` command: one parser behind `blender -c hybrid VERB ...` and `python -m hybrid_addon VERB ...`.

Exit codes: 0 done; 2 bad input, named in one line; 1 a failure in the work. Outputs appear whole or not at all.
Each verb is a module that adds its words to the parser.
"""

from __future__ import annotations

import sys
import traceback
from collections.abc import Sequence

import bpy

from ...memory import REFUSED
from ..errors import HybridError, TooLarge
from . import advise, plan, render, report, stability
from .common import COMMAND, Parser, resolution, say

__all__ = ["main", "register", "resolution", "unregister"]

VERBS = (render, advise, plan, report, stability)
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
    except (TooLarge, MemoryError) as error:
        say(f"failed: {str(error) or REFUSED}", sys.stderr)
        return 1
    except HybridError as error:
        say(f"error: {error}", sys.stderr)
        return 2
    except SystemExit as error:  # argparse: --help (0) or usage (2)
        return int(error.code or 0)
    except KeyboardInterrupt:
        say("cancelled", sys.stderr)
        return 1
    except RuntimeError as error:  # Blender's render operator: one line says it
        say(f"failed: {error}", sys.stderr)
        return 1
    except Exception:  # a bug of ours: the traceback is what a bug report needs
        traceback.print_exc()
        return 1
    return 0


def _parser() -> Parser:
    parser = Parser(prog=COMMAND, description="EEVEE draws the world, a ray tracer draws the objects you flag.")
    verbs = parser.add_subparsers(metavar="VERB", required=True, parser_class=Parser)
    for verb in VERBS:
        verb.add(verbs)
    return parser
