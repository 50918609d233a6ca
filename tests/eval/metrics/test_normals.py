"""Normal angles of rolled sheets and spheres, in closed form and against a slow reference."""

import numpy as np
import pytest

from muslin.eval.metrics.normals import normal_distance, normal_errors
from muslin.eval.metrics.vertex import statistics, triangle_areas
from muslin.garments.errors import InputError
from tests.eval.metrics.shapes import lifted, rolled, sheet, sphere, turned

UV, FACES = sheet(0.4, 0.3, 8, 6)
FLAT = lifted(UV)


@pytest.mark.parametrize("angle", [0.0, 1e-7, 0.3, np.pi / 2, np.pi - 1e-7, np.pi])
def test_turned_sheet_is_off_by_the_angle_it_was_turned(angle):
    c, s = np.cos(angle), np.sin(angle)
    around_x = FLAT @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]])
    assert normal_errors(around_x, FLAT, FACES) == pytest.approx(np.full(len(FACES), angle), abs=1e-12)


def test_error_of_a_rolled_sheet_is_how_far_its_faces_turned():
    radius = 0.2
    errors = normal_errors(rolled(UV, radius), FLAT, FACES)
    # A face between two generators has the normal of the chord, turned by the mean of their angles.
    x = UV[FACES][..., 0]
    assert errors == pytest.approx((x.min(axis=1) + x.max(axis=1)) / 2.0 / radius, abs=1e-12)
    mean = statistics(errors, triangle_areas(FLAT, FACES)).mean
    assert mean == pytest.approx(0.4 / radius / 2.0)


def test_turned_over_and_collapsed_triangles():
    both = turned(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]))
    face = np.array([[0, 1, 2]])
    assert normal_errors(both[[0, 2, 1]], both, face)[0] == pytest.approx(np.pi)
    assert normal_errors(both[[0, 1, 1]], both, face)[0] == np.pi / 2
    with pytest.raises(InputError, match="no area"):
        normal_errors(both, both[[0, 1, 1]], face)


def test_rigid_motion_of_both_sides_changes_nothing():
    rough = FLAT + 0.01 * np.random.default_rng(1).normal(size=FLAT.shape)
    expected = normal_errors(rough, FLAT, FACES)
    assert normal_errors(turned(rough), turned(FLAT), FACES) == pytest.approx(expected, abs=1e-12)
    apart = normal_distance(rough, FACES, FLAT, FACES, 500)
    together = normal_distance(turned(rough), FACES, turned(FLAT), FACES, 500)
    assert together.mean == pytest.approx(apart.mean, rel=1e-9)


def test_distance_of_two_sheets_that_cross_at_an_angle_is_that_angle():
    uv, faces = sheet(0.4, 0.3, 5, 9, "irregular")
    flat = lifted(uv)
    c, s = np.cos(0.4), np.sin(0.4)
    found = normal_distance(FLAT @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]]), FACES, flat, faces, 300)
    for side in (found.at_truth, found.at_prediction):
        assert (side.mean, side.max) == pytest.approx((0.4, 0.4))
    upside_down = normal_distance(FLAT, FACES[:, ::-1], flat, faces, 300)
    assert upside_down.mean == pytest.approx(np.pi)


def test_distance_of_spheres_shrinks_with_the_edges_and_agrees_with_the_true_sphere():
    # Against the exact sphere a face's points have normals x / |x|; the mean angle halves with the edge.
    fine = sphere(5, 1.0)
    means = [normal_distance(*sphere(k, 1.0), *fine, 2000).at_prediction.mean for k in (1, 2, 3)]
    assert means[0] / means[1] == pytest.approx(2.0, rel=0.1)
    assert means[1] / means[2] == pytest.approx(2.0, rel=0.15)


@pytest.mark.parametrize(
    "call",
    [
        lambda: normal_errors(FLAT[:-1], FLAT, FACES),
        lambda: normal_errors(np.where(FLAT > 0.3, np.nan, FLAT), FLAT, FACES),
        lambda: normal_errors(FLAT, FLAT, FACES[:0]),
        lambda: normal_errors(FLAT, FLAT, FACES + 10),
        lambda: normal_distance(FLAT, FACES, np.full((3, 3), np.nan), np.array([[0, 1, 2]])),
        lambda: normal_distance(FLAT, FACES, np.zeros((3, 3)), np.array([[0, 1, 2]])),
        lambda: normal_distance(np.zeros((3, 3)), np.array([[0, 1, 2]]), FLAT, FACES),
    ],
)
def test_bad_input_is_named(call):
    with pytest.raises(InputError):
        call()
