import igl
import numpy as np
import pytest

from muslin.garments.errors import InputError
from muslin.garments.half_edges import half_edges, on_boundary
from muslin.garments.mesh import validate_manifold
from muslin.learn.graph.decimate import decimate
from tests.learn.graph.meshes import renumbered, sheet, sphere


def loops(faces: np.ndarray) -> int:
    return len(igl.boundary_loop_all(faces.astype(np.int64)))


def euler(faces: np.ndarray, count: int) -> int:
    return count - len(np.unique(np.sort(half_edges(faces), axis=1), axis=0)) + len(faces)


@pytest.mark.parametrize("name", ["sheet", "garment", "sphere"])
def test_every_level_is_a_surface_of_the_same_kind_on_vertices_of_the_one_before(name, garment, worn):
    x, faces = {"sheet": sheet(), "garment": (worn, garment.faces), "sphere": sphere(3)}[name]
    n = len(x)
    made = decimate(x, faces, [n // 2, n // 4, n // 8])
    assert [len(kept) for kept in made.kept] == [n, n // 2, n // 4, n // 8]
    for level in range(1, 4):
        validate_manifold(made.faces[level], name)
        assert set(made.kept[level]) <= set(made.kept[level - 1])
        assert len(np.unique(made.faces[level])) == len(made.kept[level])
        assert euler(made.faces[level], len(made.kept[level])) == euler(faces, n)
        assert loops(made.faces[level]) == loops(faces)
        rim = np.unique(half_edges(made.faces[level])[on_boundary(made.faces[level])])
        old_rim = np.unique(half_edges(faces)[on_boundary(faces)])
        assert np.isin(made.kept[level][rim], old_rim).all()


def test_vertices_go_onto_kept_ones_and_kept_ones_onto_themselves():
    x, faces = sheet()
    made = decimate(x, faces, [60, 20])
    for level, onto in enumerate(made.onto):
        fine, coarse = made.kept[level], made.kept[level + 1]
        own = np.searchsorted(fine, coarse)
        assert np.array_equal(onto[own], np.arange(len(coarse)))
        assert onto.min() >= 0
        assert onto.max() < len(coarse)


def test_a_flat_sheet_keeps_its_outline_and_no_triangle_turns_over():
    x, faces = sheet()
    x[:, 2] = 0.0
    made = decimate(x, faces, [50, 12])
    for kept, left in zip(made.kept, made.faces, strict=True):
        doubled = igl.doublearea(x[kept], left.astype(np.int64))
        a, b, c = (x[kept[left[:, k]]] for k in range(3))
        assert np.cross(b - a, c - a)[:, 2].min() > 0.0
        assert 0.5 * doubled.sum() == pytest.approx(0.7, abs=1e-12)


def test_folds_keep_more_vertices_than_flat_cloth():
    x, faces = sheet(25, 33)
    x[:, 2] = np.where(x[:, 0] > 0.5, 0.05 * np.sin(60.0 * x[:, 0]), 0.05 * np.sin(30.0))
    made = decimate(x, faces, [len(x) // 4])
    assert (x[made.kept[1], 0] > 0.5).mean() > 0.65


def lost_volume(x: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = (x[faces[:, k]] for k in range(3))
    return 4.0 / 3.0 * np.pi - np.einsum("fi,fi->f", a, np.cross(b, c)).sum() / 6.0


def test_error_of_a_sphere_falls_as_that_of_the_best_triangulations():
    x, faces = sphere(3)
    counts = [320, 162, 80, 42]
    made = decimate(x, faces, counts)
    lost = [lost_volume(x[k], f) for k, f in zip(made.kept[1:], made.faces[1:], strict=True)]
    # Of inscribed polyhedra it goes as 1 / V.
    assert np.polyfit(np.log(counts), np.log(lost), 1)[0] == pytest.approx(-1.0, abs=0.15)
    assert lost[1] < 1.5 * lost_volume(*sphere(2))
    assert lost[3] < 1.5 * lost_volume(*sphere(1))


def test_numbering_makes_no_difference():
    x, faces = sheet()
    made = decimate(x, faces, [60, 20])
    y, turned, order = renumbered(x, faces)
    other = decimate(y, turned, [60, 20])
    for kept, again in zip(made.kept, other.kept, strict=True):
        assert np.array_equal(np.sort(order[again]), kept)


def test_stops_where_no_collapse_may_be():
    x = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    made = decimate(x, faces, [2])
    assert len(made.kept[1]) == 4


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda x, f: (x[:, :2], f, [5]), "must be"),
        (lambda x, f: (np.where(x == x.max(), np.nan, x), f, [5]), "finite"),
        (lambda x, f: (x, f + 1, [5]), "index them"),
        (lambda x, f: (x, f, [5, 5]), "descend"),
        (lambda x, f: (x, f, [len(x)]), "descend"),
        (lambda x, f: (x, f, []), "descend"),
        (lambda x, f: (np.vstack([x, x[:1]]), f, [5]), "no face"),
        (lambda x, f: (x, np.vstack([f, f[:1]]), [5]), "manifold"),
    ],
)
def test_bad_meshes_and_counts_are_told(change, says):
    with pytest.raises(InputError, match=says):
        decimate(*change(*sheet()))
