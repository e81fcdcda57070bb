# SPDX-License-Identifier: GPL-3.0-or-later
"""The words of the interface in other languages. What is not here stays English, as does the command line.

Blender looks up names, labels and descriptions by itself; what is put together from parts goes through `pgettext_iface`
or `pgettext_rpt` where it is written, or through `iface` where our own word is shorter than Blender's for the same. To
add a language: a module like german.py with WORDS and MESSAGES, and a line in LANGUAGES and in SENTENCES.
"""

from __future__ import annotations

import bpy

from .german import GERMAN

LANGUAGES = {"de_DE": GERMAN}
"""Words, names, tooltips: English -> the language's own."""


CONTEXT = "Hybrid"
"""Of words that Blender has, too, and translates to something else."""


def words() -> dict[str, str]:
    """Ours in the language of the user's interface; none where he has it in English."""
    if not bpy.context.preferences.view.use_translate_interface:
        return {}
    return LANGUAGES.get(bpy.app.translations.locale, {})


def iface(text: str) -> str:
    """A word as the interface shows it: ours, else Blender's, else as it is."""
    return words().get(text) or str(bpy.app.translations.pgettext_iface(text))


def sentence(text: str) -> str:
    """What the tracer or the translator says of a scene, in the user's language, with a capital letter."""
    return text[:1].upper() + text[1:]


def register() -> None:
    """Give Blender the words, for names and for operators (which have a context of their own), and for ours."""
    contexts = ("*", bpy.app.translations.contexts.operator_default, CONTEXT)
    table = {
        locale: {(context, english): own for english, own in language.items() for context in contexts}
        for locale, language in LANGUAGES.items()
    }
    bpy.app.translations.register(__package__, table)


def unregister() -> None:
    """Take them away again."""
    bpy.app.translations.unregister(__package__)
