# SPDX-License-Identifier: GPL-3.0-or-later
"""embreex's sharp edges, shown on the raw library: if one is gone, `embreex_scene` may be simplified.

Those that can crash the process or hang it run in one of their own.
"""

import gc
import subprocess
import sys
import time

import numpy as np
import pytest
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh as EmbreeMesh

from hybrid_addon.tracer.geometry.embree import TriangleScene

DOWN = np.float32([[0, 0, -1]])


def raw(vertices, triangles):
    scene = rtcore_scene.EmbreeScene(robust=True)
    mesh = EmbreeMesh(scene, np.ascontiguousarray(vertices, np.float32), np.ascontiguousarray(triangles, np.int32))
    return scene, mesh


@pytest.fixture
def ball(build):
    return build.icosphere(2)


def above(n=1):
    return np.tile(np.float32([[0.01, 0.02, 3]]), (n, 1))


def test_hazard_distances_are_overwritten(ball):
    scene, _ = raw(ball.vertices, ball.triangles)
    distances = np.float32([10, 10])
    scene.run(above(2), np.tile(DOWN, (2, 1)), dists=distances, query="DISTANCE")
    assert (distances != 10).all()
    # Ours are not.
    ours = np.float32([10, 10])
    TriangleScene(ball.vertices, ball.triangles).occluded(above(2).T, np.tile(DOWN, (2, 1)).T, ours)
    np.testing.assert_array_equal(ours, 10)


def test_hazard_occluded_says_zero_for_a_hit(ball):
    scene, _ = raw(ball.vertices, ball.triangles)
    both = np.concatenate([DOWN, -DOWN])
    np.testing.assert_array_equal(scene.run(above(2), both, query="OCCLUDED"), [0, -1])
    wrapped = TriangleScene(ball.vertices, ball.triangles)
    np.testing.assert_array_equal(wrapped.occluded(above(2).T, both.T, np.float32([9, 9])), [True, False])


def test_hazard_a_hit_at_exactly_t_max_counts(build):
    floor = build.quad([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    scene, _ = raw(floor.vertices, floor.triangles)
    assert scene.run(above(), DOWN, dists=np.float32([3]), query="OCCLUDED")[0] == 0
    assert scene.run(above(), DOWN, dists=np.float32([3 * (1 - 2.0**-20)]), query="OCCLUDED")[0] == -1


def test_hazard_a_ray_that_starts_on_a_surface_hits_it(build):
    floor = build.quad([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    scene, _ = raw(floor.vertices, floor.triangles)
    assert scene.run(np.float32([[0.1, 0.2, 0]]), -DOWN, query="INTERSECT")[0] >= 0


def test_hazard_meshes_added_after_a_query_are_not_there(ball):
    scene, _first = raw(ball.vertices + np.float32([9, 0, 0]), ball.triangles)
    assert scene.run(above(), DOWN, query="INTERSECT")[0] == -1
    _second = EmbreeMesh(scene, ball.vertices, ball.triangles)
    assert scene.run(above(), DOWN, query="INTERSECT")[0] == -1  # it is not there
    scene.is_committed = 0
    assert scene.run(above(), DOWN, query="INTERSECT")[0] >= 0


def test_hazard_vertices_that_are_not_finite_vanish_silently(ball):
    vertices = ball.vertices.copy()
    vertices[:] = np.nan
    scene, _ = raw(vertices, ball.triangles)
    assert scene.run(above(), DOWN, query="INTERSECT")[0] == -1


@pytest.mark.parametrize("length", [1e-39, 1e-42])
def test_hazard_directions_that_are_almost_zero_miss(ball, length):
    scene, _ = raw(ball.vertices, ball.triangles)
    assert scene.run(above(), DOWN * np.float32(length), query="INTERSECT")[0] == -1


def test_hazard_double_precision_is_refused(ball):
    scene, _ = raw(ball.vertices, ball.triangles)
    with pytest.raises(ValueError, match="dtype"):
        scene.run(above().astype(float), DOWN.astype(float))


def test_hazard_not_a_number_visits_the_whole_tree(build):
    ball = build.icosphere(5)
    scene, _ = raw(ball.vertices, ball.triangles)
    n = 2000
    good, bad = np.tile(DOWN, (n, 1)), np.full((n, 3), np.nan, np.float32)
    scene.run(above(n), good, query="INTERSECT")

    def seconds(direction):
        """Of this thread on a processor: how busy the machine is does not show."""
        began = time.thread_time()
        scene.run(above(n), direction, query="INTERSECT")
        return time.thread_time() - began

    assert seconds(bad[:50]) / 50 > 10 * min(seconds(good) for _ in range(5)) / n


WILD = """
import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh
scene = rtcore_scene.EmbreeScene(robust=True)
vertices = np.zeros((3, 3), np.float32)
mesh = TriangleMesh(scene, vertices, np.int32([[0, 1, 99999999], [-1, 0, 1]]))
print("accepted")
"""


def test_hazard_wild_indices_are_accepted():
    done = subprocess.run([sys.executable, "-c", WILD], capture_output=True, text=True, timeout=600, check=False)
    assert "accepted" in done.stdout


def found_by_the_search_for_cycles(make):
    """Types of what Python frees when what `make` makes, alone in a cycle, is let go of."""
    cycle = [make()]
    cycle.append(cycle)
    gc.collect()
    gc.set_debug(gc.DEBUG_SAVEALL)
    try:
        del cycle
        gc.collect()
        return [type(each) for each in gc.garbage]
    finally:
        gc.set_debug(0)
        gc.garbage.clear()
        gc.collect()


def test_hazard_a_scene_in_a_cycle_loses_its_device_first(ball):
    """Both are then cleared in any order. Freed with their last reference they are in the right one."""
    assert rtcore_scene.EmbreeScene in found_by_the_search_for_cycles(lambda: raw(ball.vertices, ball.triangles))
    found = found_by_the_search_for_cycles(lambda: TriangleScene(ball.vertices, ball.triangles))
    assert TriangleScene in found and rtcore_scene.EmbreeScene not in found
