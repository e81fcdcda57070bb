# SPDX-License-Identifier: GPL-3.0-or-later
"""The words of the interface: which there are, and that each language has them.

What Blender shows of them is looked at in a window: tests/real_blender.
"""

from __future__ import annotations

import ast
import re
from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest

import hybrid_addon
from hybrid_addon.blender import registration
from hybrid_addon.blender.render import engine
from hybrid_addon.blender.sync import coverage
from hybrid_addon.blender.sync.coverage.status import Named
from hybrid_addon.blender.ui import layout, translations
from hybrid_addon.blender.ui.translations.german import GERMAN

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


@pytest.fixture
def german(monkeypatch):
    """Blender's Python module has no languages: as in a window that is set to German."""
    app = SimpleNamespace(translations=SimpleNamespace(locale="de_DE"))
    monkeypatch.setattr(translations, "bpy", SimpleNamespace(app=app))
    monkeypatch.setattr(translations, "words", lambda: GERMAN)


def test_warnings_are_told_in_the_language_too(german):
    rough = "it shows the world blurred, but no objects: its roughness of 0.3 is not traced"
    told = translations.sentence(f"material 'A: b', 2 things: {rough} (set Rough Samples to 1 or more); something new")
    assert told.startswith("Material 'A: b', 2 Dinge: zeigt die Welt verschwommen") and "Rauheit von 0.3" in told
    assert told.endswith("something new")
    assert translations.sentence("scene 'S' has no camera: add one and make it the active camera").startswith(
        "Szene 'S' hat"
    )
    assert translations.sentence("a line of none") == "A line of none"


def test_other_countries_have_the_words_of_their_language():
    assert [translations.known(locale) for locale in ("de_DE", "de_AT", "de", "de_DE.UTF-8")] == ["de_DE"] * 4
    assert translations.known("en_US") == translations.known("") == ""


def test_templates_are_what_the_code_says():
    """What differs in a template stands between braces in the code, too: each part of it is found there, but for a few
    that the code has lost since they were translated."""
    source = " ".join(
        path.read_text(encoding="utf-8") for path in FOLDER.parent.rglob("*.py") if "german" not in path.name
    )
    source = re.sub(r'"\s*f?"', "", source)  # literals that go on in the next line
    templates = translations.SENTENCES["de_DE"]
    old = [text for text in templates if any(part.strip(" :'()%;,") not in source for part in text.split("{}"))]
    assert len(old) <= len(templates) // 20, old


NOT_SHOWN = ("measure", "blender/measure", "blender/cli", "tracer", "blender/ui/translations", "procedural",
             "accelerated.py", "blender/pipeline/note.py", "report/frame.py")  # fmt: skip
"""What only a command line or a file says, or nobody but a developer."""
SAYS = {"HybridError", "TooLarge", "UnsupportedError", "warn", "add", "append"}
"""Calls whose first argument is a line for people."""
TELLERS = {"warnings", "why_inactive", "why_not", "refusal", "problem", "unfit_to_back", "budget_warnings", "reason",
           "scene_warnings", "with_background", "_open_fog", "_translucent_bodies", "_other_layers", "_why",
           "rough_note", "ended_warnings", "nothing_to_trace"}  # fmt: skip
"""Functions that return such lines."""
PYTHON_ONLY = {"    {} ({}): {}", "scene '{}' {}", "{}: {}", "{}: rays{} need more than {} bounces: raise Max Bounces",
               "{}: lower the Min Light of {}", "{} '{}' is a library override; Blender will not save its Hybrid "
               "settings: tick and untick Ray Traced once in {}, and save that file"}  # fmt: skip
"""Put together of parts that are tested each by itself, below."""


def template(node):
    """Of a literal, with braces where something is filled in; None of anything else."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(part.value if isinstance(part, ast.Constant) else "{}" for part in node.values)
    return None


def literals(node):
    """All templates in lists and choices."""
    if template(node) is not None:
        yield template(node)
    elif isinstance(node, ast.IfExp):
        yield from [*literals(node.body), *literals(node.orelse)]
    elif isinstance(node, (ast.List, ast.Tuple, ast.BoolOp)):
        for item in node.values if isinstance(node, ast.BoolOp) else node.elts:
            yield from literals(item)
    elif isinstance(node, (ast.ListComp, ast.GeneratorExp)):
        yield from literals(node.elt)


def said():
    """Every warning, error and reason of the code that an artist may see, as templates."""
    for path in sorted(FOLDER.parent.rglob("*.py")):
        if path.relative_to(FOLDER.parent).as_posix().startswith(NOT_SHOWN):
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            values = []
            if isinstance(node, ast.FunctionDef) and node.name in TELLERS:
                values = [n.value for n in ast.walk(node) if isinstance(n, (ast.Return, ast.AugAssign)) and n.value]
            elif isinstance(node, ast.Call) and node.args:
                name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
                values = node.args[:1] if name in SAYS else []
            yield from (text for value in values for text in literals(value) if text.count(" ") > 1)
    for table in (*coverage.PROPERTIES.values(), *coverage.SOCKETS.values(), *coverage.NODE_SETTINGS.values()):
        yield from (f"{{}} {status.says}" for status in table.values() if isinstance(status, Named))
    yield from (f"object {{}}: {says}" for says in (*coverage.OBJECT_TYPES.values(), *coverage.PROBE_TYPES.values()))
    part = "5 % of the picture is darker than it should be, by 9 % of its light"
    yield from (f"{part}: rays need more than 4 bounces: raise Max Bounces", f"{part}: lower the Min Light of 1")
    yield f"scene {{}} {engine.USE_EEVEE}"
    yield (
        "object {} is a library override; Blender will not save its Hybrid settings: tick and untick Ray Traced once "
        "in {}, and save that file"
    )


def test_every_message_is_said_in_german(german):
    """A new one may wait for its translator: one in twenty."""
    lines = sorted({text.replace("'{}'", "{}").replace("{}", "'X'") for text in set(said()) - PYTHON_ONLY})
    assert len(lines) > 120
    missing = [line for line in lines if translations.translated(line) == line]
    assert len(missing) <= len(lines) // 20, missing


def test_parts_of_a_message_are_translated_each(german):
    spoken = translations.sentence("material 'A; b', 2 things: 'Scale' of node 'SSS' is not traced; it is solid in "
                                   "reflections; node 'T' has no image; it is drawn pink")  # fmt: skip
    assert spoken == ("Material 'A; b', 2 Dinge: 'Scale' von Node 'SSS' wird nicht verfolgt; es ist in "
                      "Spiegelungen undurchsichtig; Node 'T' hat kein Bild; pink gezeichnet")  # fmt: skip
    assert translations.translated("cannot retrace: 'Cube' has changed since the last render: press F12") == (
        "Kein neues Verfolgen: 'Cube' hat sich geändert seit dem letzten Rendering: F12 drücken"
    )
    assert translations.translated("{} m to {}, surface {}") == "{} m bis {}, Oberfläche {}"
