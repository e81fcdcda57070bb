# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.scene import Panorama, PointLight, Settings, Sphere, Surface
from hybrid_addon.tracer import trace

GOOD = Settings(samples=1, threads=1)


@pytest.mark.parametrize("ior", [0.0, -1.5, float("nan"), float("inf")])
def test_an_impossible_ior_is_refused_by_name(build, ior):
    s = build.scene((build.box(), Surface(name="Glass", ior=ior), {"name": "Vase"}))
    with pytest.raises(ValueError, match=r"object 'Vase', surface 'Glass': ior must be a positive number") as caught:
        trace(s, GOOD)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"opacity": 1.5}, "opacity must lie in 0..1"),
        ({"reflectivity": float("nan")}, "reflectivity must lie in 0..1"),
        ({"base_color": (0, float("nan"), 0)}, "base_color must be three finite numbers"),
        ({"roughness": float("inf")}, "roughness must be finite"),
    ],
)
def test_impossible_surfaces_are_refused(build, change, message):
    with pytest.raises(ValueError, match=message):
        trace(build.scene((build.box(), Surface(**change))), GOOD)


def test_bad_indices_never_reach_embree(build):
    box = build.box()
    for bad in (99, -1):
        triangles = box.triangles.copy()
        triangles[3, 1] = bad
        with pytest.raises(ValueError, match="mesh 'box': a triangle names a vertex that is not there"):
            trace(build.scene((replace(box, triangles=triangles), build.matte())), GOOD)
    with pytest.raises(ValueError, match="corner that is not there"):
        ball = build.icosphere(1, 1, smooth=True)
        trace(build.scene((replace(ball, corners=ball.corners + 1), build.matte())), GOOD)


def test_other_refusals(build):
    s = build.scene((build.box(), build.matte()))
    cases = [
        (replace(s, camera=replace(s.camera, projection="CUSTOM")), "PERSP, ORTHO or PANO"),
        (replace(s, camera=replace(s.camera, projection="PANO")), "a panorama is what PANO needs"),
        (replace(s, camera=replace(s.camera, projection="PANO", panorama=Panorama("ODD"))), "'ODD'"),
        (replace(s, instances=(replace(s.instances[0], mesh=7),)), "there is no mesh 7"),
        (replace(s, instances=(replace(s.instances[0], surfaces=(3,)),)), "there is no surface 3"),
        (replace(s, spheres=(Sphere("ball", (0, 0, 0), 0.0, 0),)), "object 'ball': radius must be positive"),
        (replace(s, lights=(PointLight("lamp", (0, 0, float("nan")), (1, 1, 1)),)), "light 'lamp': its place"),
    ]
    for scene, message in cases:
        with pytest.raises(ValueError, match=message):
            trace(scene, GOOD)
    with pytest.raises(ValueError, match="samples must be at least 1"):
        trace(s, replace(GOOD, samples=0))
    with pytest.raises(ValueError, match="mask: must be"):
        trace(s, GOOD, mask=np.ones((3, 3), np.float32))


def test_no_python_error_for_extreme_but_legal_numbers(build):
    s = build.scene((build.icosphere(1), build.glass(1e3)), (build.box((2, 2, 2), (3, 3, 3)), build.glass(1e-3)))
    film = trace(s, replace(GOOD, camera_sees="ALL"))
    assert np.isfinite(film.radiance).all() and film.invariants["nan_pixels"] == 0
