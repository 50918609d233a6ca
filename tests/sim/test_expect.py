"""Each entry of [expect] holds up to its bound and is reported beyond it."""

from dataclasses import replace

import numpy as np
import pytest

from muslin.garments import catalogue
from muslin.garments.triangulate import triangulate
from muslin.sim.dataset.certificate import Certificate
from muslin.sim.dataset.sample import Sample
from muslin.sim.expect import check_expectations
from muslin.sim.scene import parse_scene

CERTIFICATE = Certificate(
    cloth_cloth_intersections=0,
    cloth_body_intersections=0,
    min_distance_m=1e-3,
    force_residual=0.02,
    largest_strain=0.25,
    extra={"at_rest": True},
)


def sheet(heights: tuple[float, ...], certificate: Certificate = CERTIFICATE) -> Sample:
    """A level sheet at each of the heights, one a frame."""
    mesh = triangulate(catalogue.get("sheet").pattern(), 0.2)
    flat = np.zeros((len(heights), mesh.num_vertices, 3), np.float32)
    flat[..., 1] = np.array(heights)[:, None]
    kind = "drape" if len(heights) == 1 else "sequence"
    return Sample("sheet", kind, mesh, flat, certificate)


def violations(expect: dict, certificate: Certificate = CERTIFICATE) -> list[str]:
    scene = parse_scene({"colliders": [{"shape": "sphere", "radius": 0.25}], "expect": expect})
    return check_expectations(scene, sheet((0.5, 1.5), certificate))


@pytest.mark.parametrize(
    ("key", "holds", "fails", "measured", "allowed"),
    [
        ("largest_stretch", 1.25, 1.2, "1.25", "at most 1.2"),
        ("residual", 0.02, 0.01, "0.02", "at most 0.01"),
        ("smallest_distance", 1e-3, 2e-3, "0.001 m", "at least 0.002 m"),
        ("lowest_point", [0.5, 0.6], [0.6, 1.5], "0.5 m", "from 0.6 to 1.5 m"),
        ("highest_point", [0.5, 1.5], [0.5, 1.4], "1.5 m", "from 0.5 to 1.4 m"),
        ("frames", 2, 3, "2", "3"),
        ("at_rest", True, False, "true", "false"),
    ],
)
def test_entry(key, holds, fails, measured, allowed):
    assert violations({key: holds}) == []
    assert violations({key: fails}) == [f"expect.{key}: measured {measured}, allowed is {allowed}"]


@pytest.mark.parametrize("key", ["cloth_cloth_intersections", "cloth_body_intersections"])
def test_intersections_are_never_allowed(key):
    assert violations({}, replace(CERTIFICATE, **{key: 2})) == [f"{key}: measured 2, allowed is 0"]
    assert violations({}, replace(CERTIFICATE, **{key: None})) == [f"{key}: measured nothing, allowed is 0"]


def test_what_was_not_measured_is_a_violation():
    nothing = Certificate(cloth_cloth_intersections=0, cloth_body_intersections=0)
    expect = {"largest_stretch": 2.0, "residual": 1.0, "at_rest": True}
    assert [line.split(":")[0] for line in violations(expect, nothing)] == [
        "expect.largest_stretch",
        "expect.residual",
        "expect.at_rest",
    ]
    assert all("measured nothing" in line for line in violations(expect, nothing))


def test_cloth_that_touches_nothing_is_far_enough():
    assert violations({"smallest_distance": 1e-3}, replace(CERTIFICATE, min_distance_m=None)) == []


def test_not_a_number_violates():
    bad = replace(CERTIFICATE, min_distance_m=float("nan"), largest_strain=float("nan"))
    assert len(violations({"smallest_distance": 1e-9, "largest_stretch": 9.0}, bad)) == 2


def test_every_violation_is_listed():
    everything = {"frames": 3, "residual": 1e-3, "largest_stretch": 1.0, "smallest_distance": 1.0}
    assert len(violations(everything)) == 4
