"""Dihedral angles of cylinders, prisms and spheres; errors against a slow reference."""

import numpy as np
import pytest
import trimesh

from muslin.eval.metrics.dihedral import dihedral_angles, dihedral_errors, edge_areas, hinges
from muslin.eval.metrics.vertex import statistics
from muslin.garments.errors import InputError
from tests.eval.metrics.shapes import lifted, rolled, sheet, sphere, turned

NX, RADIUS = 16, 0.15
UV, FACES = sheet(0.4, 0.3, NX, 5)
EDGES = hinges(FACES)
STEP = 0.4 / NX / RADIUS  # angle between neighbouring generators


def slow_angle(x: np.ndarray, edge: np.ndarray) -> float:
    """By arc cosine, and the sign by which side of the first plane the second triangle's tip lies on."""
    a, b, c, d = x[edge[:4]]
    n, m = np.cross(b - a, c - a), np.cross(d - a, b - a)
    cosine = np.dot(n, m) / np.linalg.norm(n) / np.linalg.norm(m)
    return -np.sign(np.dot(n, d - a)) * np.arccos(np.clip(cosine, -1, 1))


def test_every_interior_edge_once():
    count = len(FACES)
    assert len(EDGES) == (3 * count - 2 * (NX + 5)) // 2
    for x0, x1, x2, x3, f, g in EDGES:
        assert {x0, x1, x2} == set(FACES[f])
        assert {x0, x1, x3} == set(FACES[g])
        assert (x0, x1) in zip(FACES[f], np.roll(FACES[f], -1), strict=True)


def test_cylinder_folds_at_its_generators_by_one_step_and_nowhere_else():
    angles = dihedral_angles(rolled(UV, RADIUS), EDGES)
    along = np.isclose(UV[EDGES[:, 0], 0], UV[EDGES[:, 1], 0])
    assert angles[along] == pytest.approx(np.full(along.sum(), STEP))
    assert angles[~along] == pytest.approx(np.zeros((~along).sum()), abs=1e-12)
    inside_out = rolled(UV, RADIUS) * [1.0, 1.0, -1.0]
    assert dihedral_angles(inside_out, EDGES) == pytest.approx(-angles)


def test_angles_of_a_rough_sheet_against_the_slow_reference():
    rough = lifted(UV) + 0.01 * np.random.default_rng(0).normal(size=(len(UV), 3))
    expected = np.array([slow_angle(rough, edge) for edge in EDGES])
    assert dihedral_angles(rough, EDGES) == pytest.approx(expected, abs=1e-7)
    assert dihedral_angles(turned(rough), EDGES) == pytest.approx(dihedral_angles(rough, EDGES), abs=1e-11)


def test_angles_and_their_signs_agree_with_trimesh():
    rough = turned(rolled(UV, RADIUS) + 0.01 * np.random.default_rng(0).normal(size=(len(UV), 3)))
    other = trimesh.Trimesh(rough, FACES, process=False)
    signs = np.where(other.face_adjacency_convex, 1.0, -1.0) * other.face_adjacency_angles
    theirs = dict(zip(map(frozenset, other.face_adjacency_edges.tolist()), signs, strict=True))
    angles = dihedral_angles(rough, EDGES)
    ours = dict(zip(map(frozenset, EDGES[:, :2].tolist()), angles, strict=True))
    assert ours == pytest.approx(theirs, abs=1e-7)


def test_sphere_is_convex_and_its_folds_add_up_to_its_total_mean_curvature():
    # sum |e| theta / 2 is the integral of the mean curvature: 4 pi r
    x, faces = sphere(4, 0.3)
    edges = hinges(faces)
    angles = dihedral_angles(x, edges)
    assert angles.min() > 0.0
    total = 0.5 * np.linalg.norm(x[edges[:, 1]] - x[edges[:, 0]], axis=1) @ angles
    assert total == pytest.approx(4.0 * np.pi * 0.3, rel=2e-3)


def test_rms_of_a_flattened_cylinder_is_its_closed_form():
    errors = dihedral_errors(lifted(UV), rolled(UV, RADIUS), EDGES)
    weights = edge_areas(UV[FACES], EDGES, FACES)
    # generators: 5 edges in each of NX - 1 lines, each with a third of two half cells
    cell = 0.4 / NX * 0.3 / 5
    share = 5 * (NX - 1) * cell / 3.0 / weights.sum()
    assert statistics(errors, weights).rms == pytest.approx(STEP * np.sqrt(share))
    assert statistics(errors, weights).max == pytest.approx(STEP)
    assert edge_areas(lifted(UV), EDGES, FACES) == pytest.approx(weights)


def test_errors_go_the_shorter_way_round_and_take_whole_sequences():
    x = np.array([[0.0, 0, 0], [0, 1, 0], [-1, 0, 0], [1, 0, 0]])
    edges = hinges(np.array([[0, 1, 2], [1, 0, 3]]))

    def folded(angle: float) -> np.ndarray:
        return np.concatenate([x[:3], [[np.cos(angle), 0.0, np.sin(angle)]]])

    frames = np.stack([folded(3.1), folded(1.0)])
    others = np.stack([folded(-3.1), folded(0.25)])
    expected = np.array([[2.0 * (np.pi - 3.1)], [0.75]])
    assert dihedral_errors(frames, others, edges) == pytest.approx(expected)


@pytest.mark.parametrize(
    "call",
    [
        lambda: hinges(FACES[:0]),
        lambda: hinges(np.concatenate([FACES, FACES[:1]])),
        lambda: dihedral_errors(lifted(UV), lifted(UV)[:-1], EDGES),
        lambda: dihedral_errors(np.full((len(UV), 3), np.nan), lifted(UV), EDGES),
        lambda: dihedral_errors(lifted(UV), lifted(UV), EDGES[:0]),
        lambda: edge_areas(UV[FACES][:-1], EDGES, FACES),
    ],
)
def test_bad_input_is_named(call):
    with pytest.raises(InputError):
        call()
