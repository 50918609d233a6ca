"""The certified Hausdorff distance against brute force, closed forms and invariances."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay
from scipy.spatial.transform import Rotation

from muslin.eval.metrics.closest import Surface
from muslin.eval.metrics.hausdorff import hausdorff, one_sided_hausdorff
from muslin.eval.metrics.patch_bound import patch_bound
from muslin.garments.errors import InputError

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)
SPLIT_A = np.array([[0, 1, 2], [0, 2, 3]])
UP = np.array([0.0, 0.0, 1.0])
SPLIT_B = np.array([[0, 1, 3], [1, 2, 3]])


def barycentric_grid(n: int) -> np.ndarray:
    i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1))
    keep = i + j <= n
    return np.stack([i[keep], j[keep], n - i[keep] - j[keep]], axis=1) / n


def brute_force(va: np.ndarray, fa: np.ndarray, vb: np.ndarray, fb: np.ndarray, n: int = 24):
    """h(A, B) lies between the two: every grid point against every triangle, and that plus the farthest that
    a point of A is from a grid point. Distances are trimesh's, and to its edges too (some have no area).
    """
    points = np.einsum("kc,fcd->fkd", barycentric_grid(n), va[fa]).reshape(-1, 3)
    nearest = np.full(len(points), np.inf)
    for triangle in vb[fb]:
        if np.linalg.norm(np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])) > 0:
            found = trimesh.triangles.closest_point(np.broadcast_to(triangle, (len(points), 3, 3)), points)
            nearest = np.minimum(nearest, np.linalg.norm(found - points, axis=1))
        for start, end in zip(triangle, np.roll(triangle, 1, axis=0), strict=True):
            share = (points - start) @ (end - start) / max((end - start) @ (end - start), 1e-300)
            found = start + np.clip(share, 0, 1)[:, None] * (end - start)
            nearest = np.minimum(nearest, np.linalg.norm(found - points, axis=1))
    edges = np.linalg.norm(va[fa] - np.roll(va[fa], 1, axis=1), axis=2)
    return nearest.max(), nearest.max() + edges.max() / n / np.sqrt(3.0)


def sheet(n: int, seed: int, amplitude: float) -> tuple[np.ndarray, np.ndarray]:
    """A jittered triangulation of a wavy unit square with n vertices along a side."""
    side = np.linspace(0, 1, n)
    flat = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    inner = ((flat > 0) & (flat < 1)).all(axis=1)
    flat[inner] += np.random.default_rng(seed).uniform(-0.3, 0.3, (inner.sum(), 2)) / n
    height = amplitude * np.sin(5 * flat[:, 0]) * np.cos(3 * flat[:, 1])
    return np.column_stack([flat, height]), Delaunay(flat).simplices


@pytest.mark.parametrize("seed", range(6))
def test_random_soups_against_brute_force(seed):
    rng = np.random.default_rng(seed)
    va, vb = rng.normal(size=(7, 3)), rng.normal(size=(9, 3))
    fa = np.array([rng.choice(7, 3, replace=False) for _ in range(5)])
    fb = np.array([rng.choice(9, 3, replace=False) for _ in range(8)])
    bounds = one_sided_hausdorff(va, fa, vb, fb, relative=1e-3, absolute=0.0)
    low, high = brute_force(va, fa, vb, fb)
    assert bounds.lower <= high + 1e-12
    assert bounds.upper >= low - 1e-12
    assert bounds.upper <= bounds.lower * (1 + 1e-3) + 1e-12


# coordinates of a coarse lattice and corners at random: faces without area, vertices in one place, surfaces
# that touch and overlap all occur
lattice = st.tuples(*[st.integers(0, 2)] * 3)
meshes = st.lists(lattice, min_size=3, max_size=6).flatmap(
    lambda v: st.tuples(
        st.just(np.array(v, dtype=float)),
        st.lists(st.tuples(*[st.integers(0, len(v) - 1)] * 3), min_size=1, max_size=4).map(np.array),
    )
)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(meshes, meshes)
def test_bounds_bracket_for_degenerate_meshes_too(a, b):
    bounds = one_sided_hausdorff(*a, *b, relative=0.02, absolute=0.01)
    assert bounds.upper - bounds.lower <= max(0.01, 0.02 * bounds.lower) + 1e-12
    low, high = brute_force(*a, *b, n=8)
    assert bounds.lower <= high + 1e-9
    assert bounds.upper >= low - 1e-9


@pytest.mark.parametrize("limit", [1, 10, 100, 1000])
def test_bounds_hold_whatever_limit_is_hit(limit):
    (va, fa), (vb, fb) = sheet(6, 0, 0.3), sheet(9, 1, -0.2)
    full = hausdorff(va, fa, vb, fb, relative=1e-6, absolute=0.0)
    cut = hausdorff(va, fa, vb, fb, relative=1e-6, absolute=0.0, max_triangles=limit)
    assert cut.lower <= full.upper
    assert full.lower <= cut.upper
    if limit == 1:
        assert cut.upper > full.upper


def test_sheets_a_hair_apart_are_bounded_fast():
    # chords of one curved sheet: tenths of a millimetre on edges of two centimetres
    a, b = sheet(50, 0, 0.1), sheet(50, 1, 0.1)
    bounds = hausdorff(*a, *b, relative=1e-3, absolute=0.0, max_triangles=30_000)
    assert 1e-4 < bounds.lower < 2e-3
    assert bounds.upper <= bounds.lower * (1 + 1e-3)


def test_flat_sheets_of_other_triangles_are_the_same_surface():
    (va, fa), (vb, fb) = sheet(30, 0, 0.0), sheet(30, 1, 0.0)
    bounds = hausdorff(va, fa, vb, fb, relative=0.0, absolute=0.0, max_triangles=5_000)
    assert bounds.upper <= 1e-9
    lifted = hausdorff(va, fa, vb + UP * 0.004, fb, relative=0.0, absolute=0.0, max_triangles=5_000)
    assert lifted.lower == pytest.approx(0.004, abs=1e-12)
    assert lifted.upper == pytest.approx(0.004, abs=1e-9)


def test_a_shifted_sheet_is_as_far_as_its_border_sticks_out():
    v, f = sheet(12, 3, 0.0)
    moved = v + np.array([0.3, 0.0, 0.4])
    bounds = hausdorff(v, f, moved, f)
    assert bounds.lower <= 0.5 + 1e-12 <= bounds.upper + 2e-12
    assert bounds.upper <= 0.5 * (1 + 1e-3) + 1e-12


def test_concentric_spheres_converge_to_the_gap():
    errors = []
    for subdivisions in (2, 3, 4):
        inner, outer = (trimesh.creation.icosphere(subdivisions, radius) for radius in (1.0, 1.2))
        bounds = hausdorff(
            inner.vertices, inner.faces, outer.vertices, outer.faces, relative=1e-5, absolute=0.0
        )
        assert bounds.upper >= 0.2 - 1e-12  # from a vertex of the outer one straight in
        errors.append(bounds.upper - 0.2)
    assert errors[2] <= 1e-5
    fine, rough = trimesh.creation.icosphere(5), trimesh.creation.icosphere(1)
    sagitta = 1.0 - np.linalg.norm(rough.triangles_center, axis=1).min()
    coarse = hausdorff(fine.vertices, fine.faces, rough.vertices, rough.faces)
    assert coarse.lower == pytest.approx(sagitta, rel=0.01)


def test_single_triangles_and_the_height_of_one_over_the_other():
    t = SQUARE[:3]
    bounds = hausdorff(t, np.array([[0, 1, 2]]), t + 2.5 * UP, np.array([[2, 1, 0]]))
    assert (bounds.lower, bounds.upper) == pytest.approx((2.5, 2.5))


@pytest.mark.parametrize("split", [SPLIT_A, SPLIT_B])
def test_duplicated_vertices_and_faces_without_area_change_nothing(split):
    base = SQUARE + 0.2 * np.outer([0, 1, 0, 1], UP)
    soup, separate = base[split].reshape(-1, 3), np.arange(6).reshape(2, 3)
    extra = np.vstack([separate, [0, 1, 1], [2, 2, 2]])
    plain = hausdorff(base, split, SQUARE, SPLIT_A, relative=1e-6, absolute=0.0)
    torn = hausdorff(soup, extra, SQUARE, SPLIT_A, relative=1e-6, absolute=0.0)
    assert torn.lower == pytest.approx(plain.lower, rel=2e-6)
    back = hausdorff(SQUARE, SPLIT_A, soup, extra, relative=1e-6, absolute=0.0)
    assert back.lower == pytest.approx(plain.lower, rel=2e-6)


def test_moving_both_changes_nothing():
    (va, fa), (vb, fb) = sheet(8, 0, 0.2), sheet(9, 1, 0.1)
    turn = Rotation.from_rotvec([0.3, -1.2, 0.7]).as_matrix().T
    here = hausdorff(va, fa, vb, fb, relative=1e-6, absolute=0.0)
    there = hausdorff(va @ turn + 3.0, fa, vb @ turn + 3.0, fb, relative=1e-6, absolute=0.0)
    assert there.lower == pytest.approx(here.lower, rel=3e-6)


def test_what_is_known_raises_the_lower_bound():
    v, f = sheet(6, 0, 0.1)
    assert one_sided_hausdorff(v, f, v + 0.01 * UP, f, known_lower=0.5).lower == 0.5


def test_patch_bound_is_exact_over_a_plane_and_infinite_past_its_border():
    v, f = sheet(10, 2, 0.0)
    surface = Surface(v, f)
    over = np.array([[[0.3, 0.2, 0.01], [0.7, 0.3, 0.05], [0.4, 0.8, 0.02]]])
    past = over + np.array([0.5, 0.0, 0.0])
    corners = np.concatenate([over, past])
    _, starts, feet = surface.closest(corners.mean(axis=1))
    bounds = patch_bound(corners, starts, feet, surface, 0.0)
    assert bounds[0] == pytest.approx(0.05, abs=1e-9)
    assert np.isinf(bounds[1])


@pytest.mark.parametrize("seed", range(5))
def test_patch_bound_is_never_below_the_distance(seed):
    rng = np.random.default_rng(seed)
    v, f = sheet(12, seed, 0.3)
    surface = Surface(v, f)
    middle = rng.uniform(0.2, 0.8, (200, 1, 3)) * [1, 1, 0.5]
    corners = middle + rng.normal(scale=0.08, size=(200, 3, 3))
    _, starts, feet = surface.closest(corners.mean(axis=1))
    bounds = patch_bound(corners, starts, feet, surface, 0.0)
    points = np.einsum("kc,ncd->nkd", barycentric_grid(12), corners)
    sampled = surface.closest(points.reshape(-1, 3))[0].reshape(200, -1).max(axis=1)
    assert np.isfinite(bounds).sum() > 50
    assert (bounds >= sampled - 1e-12).all()
    near = np.isfinite(bounds)
    assert np.median(bounds[near] / sampled[near]) < 1.2


@pytest.mark.parametrize(
    ("vertices", "faces", "words"),
    [
        (SQUARE, np.zeros((0, 3), int), "faces of shape"),
        (SQUARE, np.array([[0, 1, 7]]), "allowed: 0 to 3"),
        (SQUARE, np.array([[0, 1, -1]]), "allowed: 0 to 3"),
        (SQUARE[:, :2], SPLIT_A, "vertices of shape"),
        (np.where(SQUARE > 0.5, np.nan, SQUARE), SPLIT_A, "NaN or infinity at vertex 1"),
        (np.zeros((0, 3)), SPLIT_A, "vertices of shape"),
    ],
)
def test_bad_meshes_are_named(vertices, faces, words):
    for order, name in ((0, "first mesh"), (1, "second mesh")):
        pair = [(vertices, faces), (SQUARE, SPLIT_A)]
        pair = pair[::-1] if order else pair
        with pytest.raises(InputError, match=words) as error:
            hausdorff(*pair[0], *pair[1])
        assert name in str(error.value)


@pytest.mark.parametrize("options", [{"relative": -0.1}, {"absolute": np.nan}, {"relative": np.inf}])
def test_tolerances_are_checked(options):
    with pytest.raises(InputError, match="finite and not negative"):
        hausdorff(SQUARE, SPLIT_A, SQUARE, SPLIT_B, **options)
