# SPDX-License-Identifier: GPL-3.0-or-later
"""What is to be had of main memory, and the line that says that it is not enough."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from hybrid_addon import memory

ROOT = Path(__file__).resolve().parents[1]


def test_what_fits_is_not_refused():
    memory.require({"images": 100, "film": 50}, "use less", there=150)
    memory.require({"images": 1 << 60}, "use less", there=None if memory.available() is None else 1 << 61)


def test_a_refusal_says_what_takes_it_and_what_to_do():
    with pytest.raises(memory.NotEnoughMemory) as caught:
        memory.require({"film": 5 << 20, "images": 3 << 30, "nothing": 0}, "use smaller images", there=1 << 30)
    assert str(caught.value) == "not enough memory: images 3.0 GB, film 5.0 MB, of 1.0 GB that are free; " + (
        "use smaller images"
    )


@pytest.mark.skipif(sys.platform != "linux", reason="what Linux says")
def test_a_large_array_shows_in_the_peak():
    """In a process of its own: this one may have held more before."""
    code = "import numpy; from hybrid_addon import memory; a = memory.peak(); b = numpy.ones(1 << 28, numpy.uint8)"
    command = [sys.executable, "-c", f"{code}; print(memory.peak() - a)"]
    grown = int(subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT).stdout)
    assert 0.8 * (1 << 28) < grown < 1.5 * (1 << 28)


def test_what_is_free_is_said():
    there = memory.available()
    assert there is not None
    assert 0 < there < 1 << 50


@pytest.mark.parametrize("version", [1, 2])
def test_a_container_has_what_its_group_leaves_it(tmp_path: Path, version: int):
    own, root = tmp_path / "cgroup", tmp_path / "groups"
    kinds, parent, names = {
        1: ("memory", root / "memory", ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")),
        2: ("", root, ("memory.max", "memory.current", "inactive_file")),
    }[version]
    own.write_text(f"7:{kinds}:/farm/job\n3:cpu:/\n")
    limit, used, cache = names
    for folder, numbers in ((parent / "farm", (1000, 700)), (parent / "farm" / "job", (900, 100))):
        folder.mkdir(parents=True)
        (folder / limit).write_text(str(numbers[0]))
        (folder / used).write_text(str(numbers[1]))
        (folder / "memory.stat").write_text(f"anon 5\n{cache} 60\n")
    assert sorted(memory._of_groups(own, root)) == [360, 860]  # file caches can be dropped
    (parent / "farm" / limit).write_text("max" if version == 2 else str((1 << 63) - 4096))
    assert memory._of_groups(own, root) == [860]
    assert memory._of_groups(tmp_path / "none", root) == []
