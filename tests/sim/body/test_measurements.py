from __future__ import annotations

import numpy as np
import pytest
import trimesh

from muslin.garments.errors import InputError
from muslin.sim.body import BodyModel, load_body
from muslin.sim.body.measurements import girth, measure, section

LIMITS = {  # metres, of a mean adult
    "height": (1.55, 1.85), "neck": (0.30, 0.44), "chest": (0.85, 1.12), "waist": (0.65, 0.95),
    "hip": (0.90, 1.10), "upper_arm": (0.24, 0.36), "wrist": (0.13, 0.19), "thigh": (0.48, 0.65),
    "calf": (0.32, 0.42), "shoulder_width": (0.30, 0.42), "arm_length": (0.43, 0.58),
    "trunk_length": (0.45, 0.62), "inseam": (0.70, 0.90),
}  # fmt: skip


def test_mean_bodies_measure_like_people(default_body: BodyModel) -> None:
    measured = measure(default_body)
    assert measured.keys() == LIMITS.keys()
    for key, (low, high) in LIMITS.items():
        assert low < measured[key] < high, f"{key} is {measured[key]:.3f}"


def test_sexes_differ_as_they_do() -> None:
    female, male = measure(load_body("female")), measure(load_body("male"))
    assert male["height"] > female["height"] + 0.1
    assert male["shoulder_width"] / male["hip"] > female["shoulder_width"] / female["hip"]
    assert female["waist"] / female["hip"] < male["waist"] / male["hip"]


def test_the_first_beta_enlarges(default_body: BodyModel) -> None:
    small, mean, large = (measure(default_body, [beta]) for beta in (-2.0, 0.0, 2.0))
    for key in ("height", "chest", "waist", "arm_length", "inseam", "trunk_length", "shoulder_width"):
        assert small[key] < mean[key] < large[key]


def test_height_is_the_extent_along_y(default_body: BodyModel) -> None:
    beta = [0.7, -1.2]
    assert measure(default_body, beta)["height"] == np.ptp(default_body.vertices(beta)[:, 1])


@pytest.mark.parametrize("beta", [[0.0, 0.0, 3.0], [0.0, 3.0], [0.0, -3.0], 10 * [-2.0]])
def test_extreme_bodies_still_measure(default_body: BodyModel, beta: list[float]) -> None:
    assert all(0.05 < value < 2.5 for value in measure(default_body, beta).values())


def test_girth_of_a_cylinder_and_of_a_dented_one() -> None:
    cylinder = trimesh.creation.cylinder(radius=0.15, height=1.0, sections=400)
    normal = np.array([0.0, 0.0, 1.0])
    vertices, faces = np.array(cylinder.vertices), np.array(cylinder.faces)
    tape = girth(vertices, faces, np.array([3.0, 1.0, 0.1]), normal)
    assert tape == pytest.approx(2.0 * np.pi * 0.15, rel=1e-4)
    # a tape spans dents: two cylinders side by side measure like their hull
    aside = np.array([0.2, 0.0, 0.0])
    pair = np.concatenate([vertices - aside, vertices + aside])
    both = np.concatenate([faces, faces + len(vertices)])
    assert girth(pair, both, np.zeros(3), normal) == pytest.approx(tape + 2 * 0.4, rel=1e-4)


def test_girth_of_a_tilted_plane() -> None:
    box = trimesh.creation.box(extents=[0.2, 0.3, 2.0])
    normal = np.array([np.sin(0.5), 0.0, np.cos(0.5)])
    tape = girth(np.array(box.vertices), np.array(box.faces), np.zeros(3), normal)
    assert tape == pytest.approx(2 * (0.3 + 0.2 / np.cos(0.5)))


def test_a_plane_beside_the_mesh_measures_nothing() -> None:
    box = trimesh.creation.box()
    up = np.array([0.0, 1.0, 0.0])
    assert len(section(np.array(box.vertices), np.array(box.faces), 2.0 * up, up)) == 0
    assert girth(np.array(box.vertices), np.array(box.faces), 2.0 * up, up) == 0.0


def test_a_flat_section_is_measured_there_and_back() -> None:
    triangle, up = np.array([[0.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]]), np.array([0.0, 1.0, 0.0])
    assert girth(triangle, np.array([[0, 1, 2], [0, 2, 1]]), np.zeros(3), up) == pytest.approx(2.0)


def test_several_bodies_at_once_are_refused() -> None:
    with pytest.raises(InputError, match="one body at a time"):
        measure(load_body("male"), np.zeros((2, 10)))
