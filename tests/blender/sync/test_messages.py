# SPDX-License-Identifier: GPL-3.0-or-later
"""What the artist is told: few lines, whatever a file lacks."""

from __future__ import annotations

import pytest

from hybrid_addon.blender.sync.messages import Warnings

pytestmark = pytest.mark.blender


def lines(*told):
    warn = Warnings()
    for args in told:
        warn.add(*args)
    return list(warn)


def test_eleven_missing_images_are_one_line_with_their_number():
    (line,) = lines(*((f"image 'wood.{i:03}': cannot read '//tex/{i}.png'; it is drawn pink",) for i in range(11)))
    assert line.startswith("image 'wood.000': cannot read '//tex/0.png'; it is drawn pink (11 such: 'wood.000', ")
    assert line.endswith("and 6 others)")


def test_all_that_is_said_of_a_material_is_one_line():
    told = [("node 'A' is not followed", 1, "material 'M'"), ("'Scale' of node 'B' is not traced", 1, "material 'M'")]
    assert lines(*told) == ["material 'M', 2 things: node 'A' is not followed; 'Scale' of node 'B' is not traced"]


def test_nodes_of_a_material_that_lack_the_same_are_named_together():
    (line,) = lines(*((f"node {name!r} has no image", 1, "material 'M'") for name in ("A", "B", "it's")))
    assert line == "material 'M': node 'A' has no image (3 such: 'A', 'B', \"it's\")"


def test_two_materials_are_two_lines():
    assert len(lines(("node 'A' has no image", 1, "material 'M'"), ("node 'A' has no image", 1, "material 'N'"))) == 2


def test_an_apostrophe_begins_no_name():
    told = ("object 'A': the world's light is left out", "object 'A': the lamp's light is left out")
    assert lines(*((line,) for line in told)) == list(told)


def test_what_matters_most_comes_first_among_lines_and_within_one():
    told = [("faint", 2, "material 'M'"), ("an object 'A' is missing", 1), ("all black", 0, "material 'M'")]
    assert lines(*told) == ["material 'M', 2 things: all black; faint", "an object 'A' is missing"]
    assert lines(("late", 2), ("early", 0), ("late", 0)) == ["early", "late"]


def test_each_line_can_be_had_by_itself():
    warn = Warnings()
    warn.add("node 'A' has no image", 1, "material 'M'")
    warn.add("object 'B' has no UV map")
    assert list(warn.each()) == ["material 'M': node 'A' has no image", "object 'B' has no UV map"]
