"""Block matrix, incomplete Cholesky factor and conjugate gradients against reference solvers."""

from collections.abc import Callable

import numpy as np
import pytest
import warp as wp
from numpy.typing import NDArray
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import spsolve

from muslin.garments.mesh import GarmentMesh
from muslin.sim.cloth import ClothModel, build_cloth
from muslin.sim.material import load_fabric
from muslin.sim.solve.block_matrix import BlockMatrix, add_block
from muslin.sim.solve.linear import LinearSystem
from tests.sim.dense import dense

Array = NDArray[np.float64]

GRADIENT_SEED = 11


@wp.kernel(enable_backward=False)
def add_blocks(matrix: BlockMatrix, index: wp.array(dtype=wp.vec2i), block: wp.array(dtype=wp.mat33d)):
    k = wp.tid()
    add_block(matrix, index[k][0], index[k][1], block[k])


def add(linear: LinearSystem, pairs: list[tuple[int, int]], blocks: Array) -> None:
    """Those of the blocks that are not above the diagonal."""
    index = np.array(pairs, dtype=np.int32)
    lower = index[:, 0] >= index[:, 1]
    inputs = [wp.array(index[lower], dtype=wp.vec2i), wp.array(blocks[lower], dtype=wp.mat33d)]
    wp.launch(add_blocks, int(lower.sum()), [linear.matrix, *inputs], device="cpu")


def lower_factor(linear: LinearSystem) -> Array:
    """L (3 V, 3 V) of the preconditioner (L L^T)^-1."""
    f = linear.factor
    n = len(f.inverse)
    out = np.zeros((3 * n, 3 * n))
    offsets, columns, values = f.offsets.numpy(), f.columns.numpy(), f.values.numpy()
    for i in range(n):
        out[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = np.linalg.inv(f.inverse.numpy()[i])
        for a in range(offsets[i], offsets[i + 1]):
            k = columns[a]
            out[3 * i : 3 * i + 3, 3 * k : 3 * k + 3] = values[a]
    return out


def fill(linear: LinearSystem, cloth: ClothModel, seed: int, diagonal: float = 0.05) -> None:
    """A symmetric positive definite matrix in the pattern: one positive semi-definite block a stencil."""
    generator = np.random.default_rng(seed)
    linear.clear()
    for stencil in (*cloth.faces, *cloth.hinges):
        k = len(stencil)
        root = generator.normal(size=(3 * k, 2))
        blocks = (root @ root.T).reshape(k, 3, k, 3).transpose(0, 2, 1, 3)
        add(linear, [(int(i), int(j)) for i in stencil for j in stencil], blocks.reshape(-1, 3, 3))
    linear.add_diagonal(wp.array(np.full(cloth.num_vertices, diagonal), dtype=wp.float64))


def solve(linear: LinearSystem, g: Array, iterations: int, tolerance: float = 0.0) -> tuple[Array, Array]:
    """p (3 V,) of A p = -g and the report [iterations, shift, q(p), |r| / |g|]."""
    p = wp.zeros(len(g) // 3, dtype=wp.vec3d)
    linear.solve(wp.array(g.reshape(-1, 3), dtype=wp.vec3d), wp.zeros_like(p), p, tolerance, iterations)
    return p.numpy().ravel(), linear.report.numpy()


@pytest.fixture
def cloth(sheet_mesh: GarmentMesh) -> ClothModel:
    return build_cloth(sheet_mesh, load_fabric("gray-interlock"))


@pytest.fixture
def strip(flat_mesh: Callable[..., GarmentMesh]) -> ClothModel:
    """Triangles in a row, numbered along it: i couples to i - 3 ... i + 3, elimination fills nothing in."""
    n = 14
    panel = np.array([(0.01 * (i // 2 + i % 2), -0.01 * (i % 2)) for i in range(n)])
    faces = [(i, i + 1, i + 2) if i % 2 else (i + 1, i, i + 2) for i in range(n - 2)]
    return build_cloth(flat_mesh(panel, faces), load_fabric("gray-interlock"))


def test_blocks_go_to_the_pattern_and_else_to_the_list(cloth: ClothModel) -> None:
    linear = LinearSystem(cloth, "cpu")
    offsets, columns = cloth.pattern
    n = cloth.num_vertices
    inside = np.eye(n, dtype=bool)
    inside[np.repeat(np.arange(n), np.diff(offsets)), columns] = True
    pairs = [(i, j) for i in range(n) for j in range(n)]
    whole = np.random.default_rng(3).normal(size=(3 * n, 3 * n))
    whole += whole.T
    blocks = whole.reshape(n, 3, n, 3).transpose(0, 2, 1, 3).reshape(-1, 3, 3)
    linear._reserve_extras(2 * n * n)
    add(linear, pairs, blocks)
    add(linear, pairs, blocks)
    np.testing.assert_allclose(dense(linear.matrix), 2.0 * whole, rtol=1e-15)
    assert linear.matrix.extra_count.numpy()[0] == 2 * np.tril(~inside).sum()
    assert linear.extras_fit()


def test_too_short_a_list_of_blocks_grows(cloth: ClothModel) -> None:
    linear = LinearSystem(cloth, "cpu")
    capacity = len(linear.matrix.extra_index)
    offsets, columns = cloth.pattern
    last = cloth.num_vertices - 1
    far = next(j for j in range(last) if j not in columns[offsets[last] : offsets[last + 1]])
    count = capacity + 5
    pairs, blocks = [(last, far)] * count, np.tile(np.eye(3), (count, 1, 1))
    add(linear, pairs, blocks)
    assert linear.matrix.extra_count.numpy()[0] == count
    assert not linear.extras_fit()
    linear.clear()
    add(linear, pairs, blocks)
    assert linear.extras_fit()
    assert dense(linear.matrix)[3 * last, 3 * far] == count


def test_fixed_vertices_get_what_they_are_told_and_the_others_solve_for_it(strip: ClothModel) -> None:
    """p_f = A_ff^-1 (-g_f - A_fb p_b)"""
    linear = LinearSystem(strip, "cpu")
    fill(linear, strip, 4)
    a = dense(linear.matrix)
    generator = np.random.default_rng(GRADIENT_SEED)
    g, told = generator.normal(size=len(a)), generator.normal(size=(len(a) // 3, 3))
    fixed = generator.random(len(told)) < 0.3
    p = wp.zeros(len(told), dtype=wp.vec3d)
    linear.fix(fixed)
    linear.solve(wp.array(g.reshape(-1, 3), dtype=wp.vec3d), wp.array(told, dtype=wp.vec3d), p, 0.0, 400)
    b = np.repeat(fixed, 3)
    free = np.linalg.solve(a[np.ix_(~b, ~b)], -g[~b] - a[np.ix_(~b, b)] @ told.ravel()[b])
    np.testing.assert_array_equal(p.numpy()[fixed], told[fixed])
    np.testing.assert_allclose(p.numpy()[~fixed].ravel(), free, atol=1e-9 * np.abs(free).max())


def test_factor_is_exact_where_elimination_fills_nothing_in(strip: ClothModel) -> None:
    linear = LinearSystem(strip, "cpu", shift=1e-12)
    fill(linear, strip, 0)
    a = dense(linear.matrix)
    g = np.random.default_rng(GRADIENT_SEED).normal(size=len(a))
    p, report = solve(linear, g, iterations=1)
    lower = lower_factor(linear)
    np.testing.assert_allclose(lower, np.linalg.cholesky(a), atol=1e-9 * np.abs(a).max())
    # An exact preconditioner: one iteration is the solution.
    np.testing.assert_allclose(p, np.linalg.solve(a, -g), rtol=1e-7, atol=1e-7 * np.abs(p).max())
    assert report[0] == 1
    assert report[3] < 1e-8


def test_incomplete_factor_meets_the_matrix_on_the_pattern(cloth: ClothModel) -> None:
    """(L L^T)_ij = A_ij + shift diag(A) wherever the pattern has an entry."""
    linear = LinearSystem(cloth, "cpu")
    fill(linear, cloth, 1)
    a = dense(linear.matrix)
    _, report = solve(linear, np.ones(len(a)), iterations=1)
    lower = lower_factor(linear)
    np.testing.assert_allclose(lower, np.tril(lower), atol=1e-14)
    offsets, columns = cloth.pattern
    inside = np.eye(cloth.num_vertices)
    inside[np.repeat(np.arange(cloth.num_vertices), np.diff(offsets)), columns] = 1.0
    mask = np.kron(np.maximum(inside, inside.T), np.ones((3, 3)))
    shifted = a + report[1] * np.diag(np.diag(a))
    np.testing.assert_allclose(lower @ lower.T * mask, shifted, atol=1e-12 * np.abs(a).max())


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_conjugate_gradients_solve_the_system(cloth: ClothModel, seed: int) -> None:
    linear = LinearSystem(cloth, "cpu")
    fill(linear, cloth, seed)
    a = dense(linear.matrix)
    g = np.random.default_rng(GRADIENT_SEED).normal(size=len(a))
    p, report = solve(linear, g, iterations=300)
    expected = spsolve(csc_matrix(a), -g)
    np.testing.assert_allclose(p, expected, atol=1e-9 * np.abs(expected).max())
    assert report[2] == pytest.approx(0.5 * p @ a @ p + g @ p, rel=1e-9)
    assert report[3] < 1e-9


def test_conjugate_gradients_see_the_blocks_outside_the_pattern(cloth: ClothModel) -> None:
    linear = LinearSystem(cloth, "cpu")
    fill(linear, cloth, 4)
    n = cloth.num_vertices
    generator = np.random.default_rng(5)
    for _ in range(8):
        i, j = (int(v) for v in generator.choice(n, 2, replace=False))
        root = generator.normal(size=(6, 3))
        blocks = (root @ root.T).reshape(2, 3, 2, 3).transpose(0, 2, 1, 3).reshape(4, 3, 3)
        add(linear, [(i, i), (i, j), (j, i), (j, j)], blocks)
    assert linear.matrix.extra_count.numpy()[0] >= 4
    a = dense(linear.matrix)
    np.testing.assert_allclose(a, a.T, atol=1e-12)
    g = generator.normal(size=len(a))
    p, _ = solve(linear, g, iterations=300)
    expected = spsolve(csc_matrix(a), -g)
    np.testing.assert_allclose(p, expected, atol=1e-9 * np.abs(expected).max())


def test_every_iteration_lowers_the_quadratic_model(cloth: ClothModel) -> None:
    linear = LinearSystem(cloth, "cpu")
    fill(linear, cloth, 6)
    a = dense(linear.matrix)
    g = np.random.default_rng(GRADIENT_SEED).normal(size=len(a))
    models = []
    # The tenth would gain less than the rounding of the model's value.
    for iterations in range(1, 10):
        p, report = solve(linear, g, iterations)
        models.append(0.5 * p @ a @ p + g @ p)
        assert report[2] == pytest.approx(models[-1], rel=1e-9)
    assert (np.diff([0.0, *models]) < 0.0).all()


def test_a_looser_tolerance_stops_earlier_but_close_to_the_minimum(cloth: ClothModel) -> None:
    linear = LinearSystem(cloth, "cpu", shift=0.5)
    fill(linear, cloth, 7, diagonal=1e-4)
    a = dense(linear.matrix)
    g = np.random.default_rng(GRADIENT_SEED).normal(size=len(a))
    best = -0.5 * g @ np.linalg.solve(a, g)
    counts, shortfalls = [], []
    for tolerance in (0.1, 1e-3, 1e-9):
        p, report = solve(linear, g, 400, tolerance)
        counts.append(report[0])
        shortfalls.append(1.0 - (0.5 * p @ a @ p + g @ p) / best)
        assert shortfalls[-1] < tolerance
    assert 8 <= counts[0] <= counts[1] < counts[2] < 400


def test_nothing_to_solve_moves_nothing(cloth: ClothModel) -> None:
    linear = LinearSystem(cloth, "cpu")
    fill(linear, cloth, 8)
    p, report = solve(linear, np.zeros(3 * cloth.num_vertices), 100)
    np.testing.assert_array_equal(p, 0.0)
    assert report[0] == 0


def test_indefinite_matrix_gives_a_descent_direction(cloth: ClothModel) -> None:
    """Random blocks outweigh the diagonal: the factor is shifted or given up, p still descends."""
    linear = LinearSystem(cloth, "cpu")
    fill(linear, cloth, 9)
    generator = np.random.default_rng(10)
    pairs, blocks = [], []
    for i, j in cloth.edges.tolist():
        block = 10.0 * generator.normal(size=(3, 3))
        pairs += [(i, j), (j, i)]
        blocks += [block, block.T]
    add(linear, pairs, np.array(blocks))
    a = dense(linear.matrix)
    assert np.linalg.eigvalsh(a)[0] < 0.0
    g = generator.normal(size=len(a))
    p, report = solve(linear, g, 100)
    assert np.isfinite(p).all()
    assert report[1] > linear.smallest_shift
    assert g @ p < 0.0
