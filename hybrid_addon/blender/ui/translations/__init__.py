# SPDX-License-Identifier: GPL-3.0-or-later
"""The words of the interface in other languages. What is not here stays English, as does the command line.

Blender looks up names, labels and descriptions by itself; what is put together from parts goes through `pgettext_iface`
or `pgettext_rpt` where it is written, or through `iface` where our own word is shorter than Blender's for the same. To
add a language: modules like german*.py, and a line in LANGUAGES and in SENTENCES.
"""

from __future__ import annotations

import re
from functools import cache

import bpy

from .german import GERMAN
from .german_editor import EDITOR
from .german_messages import MESSAGES
from .german_presets import PRESETS
from .german_warnings import KINDS, PIXEL, WARNINGS

LANGUAGES = {"de_DE": {**GERMAN, **EDITOR, **PRESETS}}
"""Words, names, tooltips: English -> the language's own."""

SENTENCES = {"de_DE": {**MESSAGES, **WARNINGS, **PIXEL}}
"""Warnings and errors: templates, in which {} stands for what differs: a name, a number, or a part with a template of
its own."""

KINDS_IN = {"de_DE": KINDS}
"""Kinds of datablocks, as they stand before a name."""

CONTEXT = "Hybrid"
"""Of words that Blender has, too, and translates to something else."""


def words() -> dict[str, str]:
    """Ours in the language of the user's interface; none where he has it in English."""
    if not bpy.context.preferences.view.use_translate_interface:
        return {}
    return LANGUAGES.get(known(bpy.app.translations.locale), {})


def known(locale: str) -> str:
    """The locale whose words are used for this one, which may be of another country; "" if there is none."""
    return locale if locale in LANGUAGES else next((own for own in LANGUAGES if _tongue(own) == _tongue(locale)), "")


def _tongue(locale: str) -> str:
    return re.split(r"[_@.]", locale)[0]


def iface(text: str) -> str:
    """A word as the interface shows it: ours, else Blender's, else as it is."""
    return words().get(text) or str(bpy.app.translations.pgettext_iface(text))


def sentence(text: str) -> str:
    """What the tracer or the translator says of a scene, in the user's language, with a capital letter."""
    text = translated(text)
    return text[:1].upper() + text[1:]


def translated(text: str) -> str:
    """By the first template that fits, part by part; of several things of one owner each by itself."""
    locale = known(bpy.app.translations.locale)
    if not words() or locale not in SENTENCES:
        return text
    whole = _by_template(text, locale)
    if whole is not None:
        return whole
    owned = OWNED.fullmatch(text)
    if owned is not None:
        kind, name, many, what = owned.groups()
        kinds = KINDS_IN[locale]
        many = f", {many} {kinds['things']}" if many else ""
        return f"{kinds.get(kind, kind)} {name}{many}: {translated(what)}"
    parts = text.split("; ")
    for end in range(len(parts) - 1, 0, -1):  # what is listed may have a semicolon of its own: as much as fits
        first = _by_template("; ".join(parts[:end]), locale)
        if first is not None or end == 1:
            return f"{translated(parts[0]) if first is None else first}; {translated('; '.join(parts[end:]))}"
    head, between, rest = text.partition(": ")
    return f"{translated(head)}: {translated(rest)}" if between else words().get(text, text)


def _by_template(text: str, locale: str) -> str | None:
    """The whole text by a template; None: none fits."""
    for pattern, own in _patterns(locale):
        found = pattern.fullmatch(text)
        if found is not None:
            return own.format(*(part if NAME.fullmatch(part) else translated(part) for part in found.groups()))
    return None


NAME = re.compile(r"""'(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*"|[\d.,]+|\{\}""")
"""A name as repr() writes it, a number, or the place of one: nothing to translate."""

OWNED = re.compile(r"""(\w+) ('(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*")(?:, (\d+) things)?: (.+)""")
"""What is to be said of one datablock begins with its kind and its name, as repr() writes it."""


@cache
def _patterns(locale: str) -> tuple[tuple[re.Pattern[str], str], ...]:
    """Of each template what fits it, the longest first: a general one is tried last."""
    templates = sorted(SENTENCES[locale], key=len, reverse=True)
    return tuple((re.compile("(.+?)".join(map(re.escape, t.split("{}")))), SENTENCES[locale][t]) for t in templates)


def register() -> None:
    """Give Blender the words, for names and for operators (which have a context of their own), and for ours."""
    contexts = ("*", bpy.app.translations.contexts.operator_default, CONTEXT)
    table = {
        name: {(context, english): own for english, own in language.items() for context in contexts}
        for locale, language in LANGUAGES.items()
        for name in (locale, _tongue(locale))  # where it has no words for a country Blender takes the language's
    }
    bpy.app.translations.register(__package__, table)


def unregister() -> None:
    """Take them away again."""
    bpy.app.translations.unregister(__package__)
