# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/manual/settings.md says what the properties' own descriptions say: they cannot drift."""

from __future__ import annotations

import pytest

from tools.pages.blocks import fill
from tools.pages.from_code import SETTINGS, settings_blocks

pytestmark = pytest.mark.blender


def test_the_page_of_settings_is_up_to_date(addon):
    page = SETTINGS.read_text(encoding="utf-8")
    assert page == fill(page, settings_blocks()), "run: make pages"


def test_every_property_has_words_for_the_manual(addon):
    tables = settings_blocks()
    rows = [row for name in ("object", "material", "collection", "scene") for row in tables[name].splitlines()[2:]]
    assert len(rows) > 25
    assert all(cell.strip() for row in rows for cell in row.strip("|").split("|"))
