# SPDX-License-Identifier: GPL-3.0-or-later
"""The words of the interface: which there are, and that each language has them.

What Blender shows of them is looked at in a window: tests/real_blender.
"""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest

import hybrid_addon
from hybrid_addon.blender import registration
from hybrid_addon.blender.ui import layout, translations
from hybrid_addon.blender.ui.translations.german import GERMAN
from hybrid_addon.blender.ui.translations.german_messages import MESSAGES

pytestmark = pytest.mark.blender
FOLDER = Path(hybrid_addon.__file__).parent / "blender"
LITERAL = r'\b(?:text=|heading=|title=|poll_message_set\(|iface_?\(|rpt_\(|\bn_\()\s*"((?:[^"\\]|\\.)+)"'
OWN = (bpy.types.PropertyGroup, bpy.types.Operator, bpy.types.Panel, bpy.types.Menu)
BLENDERS = {"Depth", "Normal", "Shadow", "Samples", "Mask", "None", "Simple", "Threads", "Viewport", "IOR", "Show",
            "Extend", "Preset", "X", "Y", "Coverage", "Why", "Cost", "Roughness", "Sampling", "Light Paths", "Shadows",
            "Performance", "Passes", "Preview", "Advanced", "Distance", "Ambient Occlusion"}  # fmt: skip
"""Words that Blender has itself, or that stand nowhere."""


def words():
    """Everything that the interface shows."""
    found = {literal for path in FOLDER.rglob("*.py")
             for literal in re.findall(LITERAL, path.read_text(encoding="utf-8"))}  # fmt: skip
    found |= set(layout.BESIDE.values())
    for cls in (c for c in registration._CLASSES if issubclass(c, OWN)):
        found |= {getattr(cls, "bl_label", ""), getattr(cls, "bl_description", "")}
        deferred = [p for base in cls.__mro__ for p in getattr(base, "__annotations__", {}).values()]
        for keywords in (p.keywords for p in deferred if hasattr(p, "keywords")):
            if "HIDDEN" not in keywords.get("options", ()):
                items = [word for item in keywords.get("items", ()) for word in item[1:3]]
                found |= {keywords.get("name", ""), keywords.get("description", ""), *items}
    return found - {""}


@pytest.mark.parametrize("locale", translations.LANGUAGES)
def test_each_language_has_the_words_of_the_interface(addon, locale):
    """None that is nowhere shown, and of those that are shown nearly all: a new one may wait for its translator."""
    language, shown = translations.LANGUAGES[locale], words()
    assert len(shown) > 100
    assert not language.keys() - shown
    missing = sorted(shown - language.keys() - BLENDERS)
    assert len(missing) <= 0.1 * len(shown), missing


@pytest.mark.parametrize("locale", translations.LANGUAGES)
def test_what_is_filled_in_is_the_same_in_each_language(locale):
    for english, own in translations.LANGUAGES[locale].items():
        assert own.strip() == own and own
        assert re.findall(r"\{[^}]*\}", english) == re.findall(r"\{[^}]*\}", own)
        assert not own.endswith(".") and not english.endswith(".")


def test_warnings_are_told_in_the_language_too(monkeypatch):
    app = SimpleNamespace(translations=SimpleNamespace(locale="de_DE"))
    monkeypatch.setattr(translations, "bpy", SimpleNamespace(app=app))
    monkeypatch.setattr(translations, "words", lambda: GERMAN)
    rough = "it shows the world blurred, but no objects: its roughness of 0.3 is not traced"
    told = translations.sentence(f"material 'A: b', 2 things: {rough} (set Rough Samples to 1 or more); something new")
    assert told.startswith("Material 'A: b', 2 things: zeigt die Welt verschwommen") and "Rauheit von 0.3" in told
    assert told.endswith("something new")
    assert translations.sentence("scene 'S' has no camera: add one and make it the active camera").startswith(
        "Szene 'S' hat"
    )
    assert translations.sentence("a line of none") == "A line of none"


def test_other_countries_have_the_words_of_their_language():
    assert [translations.known(locale) for locale in ("de_DE", "de_AT", "de", "de_DE.UTF-8")] == ["de_DE"] * 4
    assert translations.known("en_US") == translations.known("") == ""


def test_templates_are_what_the_code_says():
    """What differs in a template stands between braces in the code, too: each part of it is found there."""
    source = " ".join(
        path.read_text(encoding="utf-8") for path in FOLDER.parent.rglob("*.py") if "german" not in path.name
    )
    source = re.sub(r'"\s*f?"', "", source)  # literals that go on in the next line
    for template in MESSAGES:
        for part in template.split("{}"):
            assert part.strip(" :'()%;,") in source, template
