"""Green strain, edge lengths and areas of stretched and sheared sheets, in closed form."""

import numpy as np
import pytest

from muslin.eval.metrics.change import area_changes, edge_length_changes, side_weights
from muslin.eval.metrics.checks import corner_areas
from muslin.eval.metrics.strain import green_strain, percentiles
from muslin.eval.metrics.vertex import statistics
from muslin.garments.errors import InputError
from tests.eval.metrics.shapes import lifted, rolled, sheet, turned

UV, FACES = sheet(0.4, 0.6, 7, 9, "irregular")
PANELS = UV[FACES]
AREAS = corner_areas(PANELS)


def test_stretched_sheet_has_its_strain_along_warp_and_weft():
    found = green_strain(turned(lifted(UV * [0.9, 1.2])), FACES, PANELS)
    assert found.warp == pytest.approx(np.full(len(FACES), (1.2**2 - 1) / 2))  # y is the warp
    assert found.weft == pytest.approx(np.full(len(FACES), (0.9**2 - 1) / 2))
    assert found.shear == pytest.approx(np.zeros(len(FACES)), abs=1e-12)
    assert found.major == pytest.approx(found.warp)
    assert found.minor == pytest.approx(found.weft)


@pytest.mark.parametrize("shear", [0.0, 0.02, 0.5, -1.0])
def test_simple_shear_has_the_strain_of_the_textbook(shear):
    found = green_strain(lifted(UV + shear * UV[:, [1]] * [1.0, 0.0]), FACES, PANELS)
    assert found.shear == pytest.approx(np.full(len(FACES), shear / 2), abs=1e-12)
    assert found.warp == pytest.approx(np.full(len(FACES), shear**2 / 2), abs=1e-12)
    assert found.weft == pytest.approx(np.zeros(len(FACES)), abs=1e-12)
    root = np.sqrt(shear**4 / 16 + shear**2 / 4)
    assert found.major == pytest.approx(np.full(len(FACES), shear**2 / 4 + root), abs=1e-12)
    assert found.minor == pytest.approx(np.full(len(FACES), shear**2 / 4 - root), abs=1e-12)


def test_random_triangles_against_the_slow_reference():
    x = lifted(UV) + 0.05 * np.random.default_rng(0).normal(size=(2, len(UV), 3))
    found = green_strain(x, FACES, PANELS)
    for frame in range(2):
        for face in range(len(FACES)):
            u = PANELS[face][:, ::-1]
            p = x[frame][FACES[face]]
            gradient = np.stack([p[1] - p[0], p[2] - p[0]], 1) @ np.linalg.inv(
                np.stack([u[1] - u[0], u[2] - u[0]], 1)
            )
            E = 0.5 * (gradient.T @ gradient - np.eye(2))
            here = [getattr(found, name)[frame, face] for name in ("warp", "weft", "shear", "minor", "major")]
            assert here == pytest.approx([E[0, 0], E[1, 1], E[0, 1], *np.linalg.eigvalsh(E)], abs=1e-10)


def test_rolling_costs_strain_that_falls_by_second_order():
    worst = []
    for n in (10, 20, 40):
        uv, faces = sheet(0.4, 0.4, n, n)
        worst.append(np.abs(green_strain(rolled(uv, 0.2), faces, uv[faces]).minor).max())
    assert np.array(worst[:-1]) / worst[1:] == pytest.approx([4.0, 4.0], rel=0.02)


def test_percentiles_by_area_do_not_depend_on_the_mesh():
    # warp stretch rises from 1 to 1.2 along y: the q-quantile of the strain is that of y
    uv, faces = sheet(0.3, 1.0, 3, 400, "structured")
    graded = np.column_stack([uv[:, 0], uv[:, 1] + 0.1 * uv[:, 1] ** 2, 0 * uv[:, 0]])
    strain = green_strain(graded, faces, uv[faces]).warp
    found = percentiles(strain, corner_areas(uv[faces]))
    for name, q in (("p1", 0.01), ("p5", 0.05), ("p50", 0.5), ("p95", 0.95), ("p99", 0.99)):
        assert getattr(found, name) == pytest.approx(((1 + 0.2 * q) ** 2 - 1) / 2, abs=1e-3)
    assert (found.min, found.max) == (strain.min(), strain.max())
    plain = percentiles(np.array([-3.0, 1.0, 2.0]), np.array([0.02, 0.0, 0.98]))
    assert (plain.min, plain.p1, plain.p5, plain.p99) == (-3.0, -3.0, 2.0, 2.0)


def test_edge_lengths_and_areas_of_a_stretched_sheet():
    x = turned(lifted(UV * [0.9, 1.2]))
    assert area_changes(x, FACES, PANELS) == pytest.approx(np.full(len(FACES), 0.9 * 1.2 - 1))
    side = PANELS[:, [1, 2, 0]] - PANELS[:, [2, 0, 1]]  # from corner k + 2 to k + 1
    expected = np.linalg.norm(side * [0.9, 1.2], axis=2) / np.linalg.norm(side, axis=2) - 1
    # side k lies opposite corner k
    assert edge_length_changes(x, FACES, PANELS) == pytest.approx(expected)
    assert edge_length_changes(x[None], FACES, lifted(UV))[0] == pytest.approx(expected)
    assert area_changes(x, FACES, x) == pytest.approx(np.zeros(len(FACES)), abs=1e-12)


def test_uniform_growth_and_its_weights():
    changes = edge_length_changes(1.03 * lifted(UV), FACES, lifted(UV))
    weights = side_weights(AREAS)
    assert weights.sum() == pytest.approx(0.24)
    assert statistics(np.abs(changes), weights).mean == pytest.approx(0.03)
    assert area_changes(np.zeros_like(lifted(UV)), FACES, PANELS) == pytest.approx(-np.ones(len(FACES)))


@pytest.mark.parametrize(
    "call",
    [
        lambda: green_strain(lifted(UV), FACES, PANELS[:-1]),
        lambda: green_strain(lifted(UV), FACES, lifted(UV)[FACES]),
        lambda: green_strain(lifted(UV), FACES, 0.0 * PANELS),
        lambda: green_strain(np.full((len(UV), 3), np.nan), FACES, PANELS),
        lambda: green_strain(lifted(UV)[:-1], FACES, PANELS),
        lambda: percentiles(np.zeros(0)),
        lambda: percentiles(np.array([np.nan])),
        lambda: percentiles(np.ones(2), np.array([1.0, -1.0])),
        lambda: edge_length_changes(lifted(UV), FACES, lifted(UV)[:-1]),
        lambda: area_changes(lifted(UV), FACES, np.full_like(PANELS, np.inf)),
    ],
)
def test_bad_input_is_named(call):
    with pytest.raises(InputError):
        call()
