"""Surface distances against closed forms, and against a slow, dense reference."""

import igl
import numpy as np
import pytest
import trimesh

from muslin.eval.metrics.closest import point_triangle_distance
from muslin.eval.metrics.hausdorff import hausdorff, one_sided_hausdorff
from muslin.eval.metrics.point_sets import chamfer, vertex_hausdorff
from muslin.eval.metrics.surface_pair import compare_surfaces
from muslin.eval.metrics.surface_sampling import point_to_surface, sample_surface, surface_distance
from muslin.garments.errors import InputError

QUAD = np.array([[0, 0, 0], [1, 0, 0.2], [1, 1, 0], [0, 1, 0.2]], dtype=float)
SPLIT_A = np.array([[0, 1, 2], [0, 2, 3]])
SPLIT_B = np.array([[0, 1, 3], [1, 2, 3]])


def sphere(radius: float = 1.0, subdivisions: int = 2):
    mesh = trimesh.creation.icosphere(subdivisions, radius)
    return np.array(mesh.vertices), np.array(mesh.faces)


def dense(vertices: np.ndarray, faces: np.ndarray, n: int) -> np.ndarray:
    """All barycentric grid points of every triangle."""
    i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1))
    keep = i + j <= n
    w = np.stack([i[keep], j[keep], n - i[keep] - j[keep]], axis=1) / n
    return np.einsum("kc,fcd->fkd", w, vertices[faces]).reshape(-1, 3)


def test_quad_split_both_ways():
    # one split has a valley along z = 0, the other a ridge along z = 0.2; from the middle of the ridge each
    # triangle below, such as z = 0.2 (x - y), is 0.2 / sqrt(1 + 2 * 0.2^2) away
    exact = 0.2 / np.sqrt(1 + 2 * 0.2**2)
    bounds = hausdorff(QUAD, SPLIT_A, QUAD, SPLIT_B, relative=1e-7, absolute=1e-9)
    assert bounds.lower == pytest.approx(exact, rel=1e-6) == 0.19245008972987526
    assert bounds.lower <= exact * (1 + 1e-12)
    assert bounds.upper >= exact * (1 - 1e-12)
    assert surface_distance(QUAD, SPLIT_A, QUAD, SPLIT_B, 100_000).mean == pytest.approx(0.06415, abs=1e-4)


def test_parallel_squares_are_their_distance_apart():
    flat = QUAD * [1, 1, 0]
    lifted = flat + np.array([0, 0, 0.01])
    bounds = hausdorff(flat, SPLIT_A, lifted, SPLIT_B)
    assert bounds.lower == pytest.approx(0.01)
    assert bounds.upper <= 0.0101 + 1e-12
    distance = surface_distance(flat, SPLIT_A, lifted, SPLIT_B, 500)
    assert (distance.mean, distance.rms) == pytest.approx((0.01, 0.01))


def test_one_side_differs_from_the_other():
    # a small square inside a large one: nothing from small to large, the corner gap from large to small
    flat = QUAD * [1, 1, 0]
    small = flat * 0.5 + [0.25, 0.25, 0]
    assert one_sided_hausdorff(small, SPLIT_A, flat, SPLIT_A).upper <= 1e-5
    gap = 0.25 * np.sqrt(2)
    bounds = hausdorff(small, SPLIT_A, flat, SPLIT_A)
    assert bounds.lower <= gap + 1e-12 <= bounds.upper + 1e-9
    assert bounds.upper - bounds.lower <= 0.01 * gap + 1e-12


@pytest.mark.parametrize("seed", range(4))
def test_bounds_hold_against_dense_sampling(seed):
    rng = np.random.default_rng(seed)
    va, fa = sphere(0.5, 1)
    vb, fb = sphere(0.5, 2)
    vb = vb + 0.05 * rng.normal(size=vb.shape)
    bounds = hausdorff(va, fa, vb, fb, relative=1e-3)
    n = 40
    sampled = max(
        point_to_surface(dense(va, fa, n), vb, fb).max(), point_to_surface(dense(vb, fb, n), va, fa).max()
    )
    longest = 0.7 / n  # every point is nearer than this to a grid point, and distance is 1-Lipschitz
    assert sampled <= bounds.upper + 1e-12
    assert bounds.lower <= sampled + longest
    assert bounds.upper - bounds.lower <= max(1e-5, 1e-3 * bounds.lower) + 1e-12


def test_scaling_symmetry_and_identity():
    v, f = sphere(1.0, 1)
    w = v * [1, 1.1, 1]
    there, back = hausdorff(v, f, w, f, absolute=0), hausdorff(w, f, v, f, absolute=0)
    assert there.lower == pytest.approx(back.lower, rel=0.02)
    scaled = hausdorff(3 * v, f, 3 * w, f, absolute=0)
    assert (scaled.lower, scaled.upper) == pytest.approx((3 * there.lower, 3 * there.upper))
    same = hausdorff(v, f, v, f)
    assert same.lower == pytest.approx(0, abs=1e-12)
    assert same.upper <= 1e-5


def test_point_triangle_distance_against_brute_force():
    rng = np.random.default_rng(5)
    triangles, points = rng.normal(size=(30, 3, 3)), rng.normal(size=(30, 3))
    i, j = np.meshgrid(np.linspace(0, 1, 301), np.linspace(0, 1, 301))
    keep = i + j <= 1
    w = np.stack([i[keep], j[keep], 1 - i[keep] - j[keep]], axis=1)
    pairs = list(zip(triangles, points, strict=True))
    brute = np.array([np.linalg.norm(w @ t - p, axis=1).min() for t, p in pairs])
    exact = point_triangle_distance(points, triangles)
    assert (exact <= brute + 1e-12).all()
    assert exact == pytest.approx(brute, abs=0.02)
    library = [point_to_surface(p[None], t, np.array([[0, 1, 2]]))[0] for t, p in pairs]
    assert exact == pytest.approx(library)


def test_samples_are_uniform_in_area():
    v = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [4, 0, 0], [4, 3, 0]])
    f = np.array([[0, 1, 2], [1, 3, 4]])  # areas 0.5 and 4.5
    points = sample_surface(v, f, 10_000)
    small = points[:, 0] + points[:, 1] < 1
    assert small.mean() == pytest.approx(0.1, abs=1e-3)
    assert points[small].mean(axis=0) == pytest.approx([1 / 3, 1 / 3, 0], abs=5e-3)
    assert points[~small].mean(axis=0) == pytest.approx([3, 1, 0], abs=1e-2)


def test_empty_surfaces_are_refused():
    v, none = np.zeros((3, 3)), np.zeros((0, 3), dtype=int)
    with pytest.raises(InputError):
        hausdorff(v, none, v, np.array([[0, 1, 2]]))
    with pytest.raises(InputError, match="area 0"):
        sample_surface(v, np.array([[0, 1, 2]]), 10)


def test_standard_errors_are_as_large_as_the_spread_over_seeds():
    v, f = sphere(1.0, 2)
    w = v * (1 + 0.1 * np.sin(4 * v[:, :1]))
    exact = surface_distance(v, f, w, f, samples=400_000).mean
    found = [surface_distance(v, f, w, f, samples=800, seed=seed) for seed in range(40)]
    actual = np.sqrt(np.mean([(one.mean - exact) ** 2 for one in found]))
    stated = np.sqrt(np.mean([one.mean_error**2 for one in found]))
    assert 0.6 < stated / actual < 1.6


def test_points_are_added_until_the_mean_is_as_sure_as_asked():
    v, f = sphere(1.0, 2)
    w = v * (1 + 0.1 * np.sin(4 * v[:, :1]))
    sure = surface_distance(v, f, w, f, samples=400, relative=1e-3)
    exact = surface_distance(v, f, w, f, samples=400_000)
    assert sure.mean_error <= 1e-3 * sure.mean
    assert sure.samples > 400
    assert sure.mean == pytest.approx(exact.mean, rel=4e-3)
    assert sure.rms == pytest.approx(exact.rms, rel=4 * sure.rms_error / sure.rms)
    stopped = surface_distance(v, f, w, f, samples=400, relative=1e-9, max_samples=4000)
    assert 400 < stopped.samples <= 4000
    assert stopped.mean_error > 1e-9 * stopped.mean


def test_a_pair_has_the_figures_of_its_parts():
    v, f = sphere(1.0, 2)
    w, g = sphere(1.1, 1)
    pair = compare_surfaces(v, f, w, g, samples=4000)
    assert pair.distance == surface_distance(v, f, w, g, samples=4000)
    alone = hausdorff(v, f, w, g)
    assert pair.hausdorff.lower <= alone.upper
    assert alone.lower <= pair.hausdorff.upper
    assert pair.distance.largest <= pair.hausdorff.lower
    assert pair.hausdorff.upper <= pair.hausdorff.lower * 1.001 + 1e-12


def test_vertices_alone_miss_the_quad():
    assert vertex_hausdorff(QUAD, SPLIT_A, QUAD, SPLIT_B) == pytest.approx((0.0, 0.0), abs=1e-15)
    v, f = sphere(1.0, 2)
    w = v * [1, 1.1, 1]
    assert max(vertex_hausdorff(v, f, w, f)) == pytest.approx(igl.hausdorff(v, f, w, f))


def test_chamfer_by_its_four_names():
    a = np.array([[0.0, 0, 0], [1, 0, 0]])
    b = np.array([[0.0, 3, 0], [1, 0, 0], [1, 0, 4], [0, 0, 0]])
    found = chamfer(a, b)  # from a: 0, 0; from b: 3, 0, 4, 0
    assert (found.mean_ab, found.mean_ba, found.largest) == (0.0, 1.75, 4.0)
    assert (found.sum_plain, found.mean_plain) == (1.75, 0.875)
    assert (found.sum_squared, found.mean_squared) == (6.25, 3.125)


def test_bad_points_and_counts_are_named():
    v, f = sphere(1.0, 1)
    with pytest.raises(InputError, match="second points: NaN or infinity in 1 points"):
        chamfer(v, np.array([[0, 0, np.nan]]))
    with pytest.raises(InputError, match="first points"):
        chamfer(np.zeros((0, 3)), v)
    for options in ({"samples": 3}, {"relative": 0.0}, {"max_samples": 0}):
        with pytest.raises(InputError, match="8 samples or more"):
            surface_distance(v, f, v, f, **options)
    with pytest.raises(InputError, match="second mesh: NaN"):
        surface_distance(v, f, v + np.nan, f)
