# SPDX-License-Identifier: GPL-3.0-or-later
"""Our own Embree scene, called by kernels, beside embreex' own."""

import gc

import numpy as np
import pytest

from hybrid_addon import accelerated
from hybrid_addon.tracer.geometry import embree
from hybrid_addon.tracer.geometry.embree import library
from hybrid_addon.tracer.geometry.embree.embreex_scene import EmbreexScene

from .inputs import Source, _rays, embree_scene


def test_the_same_scene_answers_alike_with_kernels_and_without(kernels):
    vertices, triangles = embree_scene()._triangles
    ids = np.arange(len(triangles), dtype=np.int32)[::-1] + 7
    origin, direction = _rays(Source(np.random.default_rng(1), 3001, 0.3))
    far = np.full(3001, 2, np.float32)
    own = embree.TriangleScene(vertices, triangles, ids)
    accelerated.use(False)
    other = embree.TriangleScene(vertices, triangles, ids)
    assert isinstance(own._tree, embree.OwnScene) and isinstance(other._tree, EmbreexScene)
    wanted = other.intersect(origin, direction), other.occluded(origin, direction, far)
    assert 0.1 < (wanted[0] >= 0).mean() < 0.99 and 0.1 < wanted[1].mean() < 0.99
    for on in (True, False):  # should the kernels fail, the scene answers by embreex
        accelerated.use(on)
        np.testing.assert_array_equal(own.intersect(origin, direction), wanted[0])
        np.testing.assert_array_equal(own.occluded(origin, direction, far), wanted[1])


def test_a_scene_is_freed_with_its_last_reference(kernels, monkeypatch):
    freed = []
    monkeypatch.setattr(library._device()[0], "rtcReleaseScene", freed.append)
    scene = embree.TriangleScene(*embree_scene()._triangles)
    address = int(scene._tree.address)
    cycle = [scene.called(None), scene]
    cycle.append(cycle)
    del scene, cycle
    assert address not in freed
    gc.collect()
    assert address in freed and address not in embree._own


def test_what_embree_refuses_is_an_error(monkeypatch):
    vertices, triangles = embree_scene()._triangles
    monkeypatch.setattr(library, "VERTEX", 99)
    with pytest.raises(RuntimeError, match="Embree cannot build a search tree: error"):
        library.Triangles(vertices, triangles)
    monkeypatch.undo()
    monkeypatch.setattr(library._device()[0], "rtcGetDeviceError", lambda device: library.OUT_OF_MEMORY)
    with pytest.raises(MemoryError, match="Embree has no memory left"):
        library.Triangles(vertices, triangles)


@pytest.mark.parametrize(
    "system, name",
    [
        ("Linux", "embreex.libs/libembree4-4aef3270.so.4"),
        ("Windows", "embreex.libs/embree4-9c1e.dll"),
        ("Windows", "embreex.libs/embree4.dll"),
        ("Darwin", "embreex/.dylibs/libembree4.4.dylib"),
        ("Plan 9", ""),
    ],
)
def test_the_library_is_found_beside_embreex(monkeypatch, tmp_path, system, name):
    for other in ("embreex/__init__.py", "embreex.libs/libtbb-dcf6.so.12", "embreex.libs/tbb12.dll", name):
        file = tmp_path / other
        if other:
            file.parent.mkdir(parents=True, exist_ok=True)
            file.touch()
    monkeypatch.setattr(library.embreex, "__file__", str(tmp_path / "embreex" / "__init__.py"))
    found = library.library_file(system)
    assert found is None if not name else found is not None and found.samefile(tmp_path / name)
