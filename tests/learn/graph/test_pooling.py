import numpy as np
import pytest

from muslin.learn.graph.decimate import decimate
from muslin.learn.graph.pooling import pool_matrix, unpool_matrix
from muslin.learn.graph.pyramid import PyramidCache, build_pyramid
from tests.learn.graph.meshes import sheet


@pytest.fixture(scope="module")
def bent():
    x, faces = sheet()
    return x, decimate(x, faces, [60, 20])


def test_down_after_up_is_the_identity(bent):
    x, made = bent
    for level in range(2):
        fine, coarse = made.kept[level], made.kept[level + 1]
        down = pool_matrix(np.searchsorted(fine, coarse), len(fine))
        up = unpool_matrix(x, made, level)
        assert np.array_equal((down @ up).toarray(), np.eye(len(coarse)))


def test_up_after_down_is_a_projection_that_keeps_constants(bent):
    x, made = bent
    down = pool_matrix(np.searchsorted(made.kept[0], made.kept[1]), len(x))
    both = (unpool_matrix(x, made, 0) @ down).toarray()
    np.testing.assert_allclose(both @ both, both, atol=1e-7)
    np.testing.assert_allclose(both.sum(axis=1), 1.0, atol=1e-6)
    assert both.min() >= 0.0


def test_linear_functions_of_a_flat_sheet_pass():
    x, faces = sheet()
    x[:, 2] = 0.0
    made = decimate(x, faces, [50])
    values = x @ [[2.0, 1.0], [-3.0, 0.5], [0.0, 0.0]] + [0.1, -0.2]
    np.testing.assert_allclose(unpool_matrix(x, made, 0) @ values[made.kept[1]], values, atol=1e-6)


def test_a_layer_above_does_not_reach_down():
    """A long strip folded in two: above each vertex another layer lies nearer than its own neighbours do."""
    x, faces = sheet(7, 61)
    along, folded = 12.0 * x[:, 0], x.copy()
    folded[:, 0] = np.minimum(along, 12.0 - along)
    folded[:, 2] = np.where(along > 6.0, 0.01, 0.0)
    made = decimate(folded, faces, [len(x) // 4])
    up = unpool_matrix(folded, made, 0) @ along[made.kept[1]]
    assert np.abs(up - along)[np.abs(along - 6.0) > 1.0].max() < 0.6


def test_a_pyramid_is_stored_and_read_again(tmp_path):
    x, faces = sheet()
    made = PyramidCache(tmp_path, 3).get(x, faces)
    assert made.counts == (108, 27, 6)
    (file,) = tmp_path.iterdir()
    cache = PyramidCache(tmp_path, 3)
    again = cache.get(x, faces)
    assert cache.get(x, faces) is again
    assert file.exists()
    assert len(list(tmp_path.iterdir())) == 1
    direct = build_pyramid(x, faces, 3)
    for other in (again, direct):
        for a, b in zip(made.laplacians + made.unpools, other.laplacians + other.unpools, strict=True):
            assert (a != b).nnz == 0
            assert a.dtype == b.dtype == np.float32
        for a, b in zip(made.pools, other.pools, strict=True):
            assert np.array_equal(a, b)


def test_another_mesh_or_other_numbers_of_levels_are_another_pyramid(tmp_path):
    x, faces = sheet()
    PyramidCache(tmp_path, 3).get(x, faces)
    PyramidCache(tmp_path, 2).get(x, faces)
    PyramidCache(tmp_path, 3).get(x * 1.01, faces)
    assert len(list(tmp_path.iterdir())) == 3
