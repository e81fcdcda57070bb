# SPDX-License-Identifier: GPL-3.0-or-later
"""The door by which Blender enters this extension. The house is the package hybrid_addon beside it.

Nothing is imported before it is asked for: an import here would load the package twice in the test suite.
"""

import importlib
from typing import Any


def register() -> None:
    """Called by Blender when the add-on is enabled."""
    _house().register()


def unregister() -> None:
    """Called by Blender when the add-on is disabled."""
    _house().unregister()


def __getattr__(name: str) -> Any:
    """Forward the public API, so that ``from bl_ext.user_default import hybrid_addon as hybrid`` is enough."""
    if name.startswith("__") or not __package__:  # loaded as a file, as pytest does in a folder with a dot in its name
        raise AttributeError(name)
    return getattr(_house(), name)


def _house() -> Any:
    return importlib.import_module(".hybrid_addon", __package__)
