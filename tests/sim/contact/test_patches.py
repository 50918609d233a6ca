"""Patches: every primitive in one, layers apart; how far two can come together, against random points."""

import numpy as np
import pytest
import warp as wp

from muslin.sim.cloth import build_cloth, merge_cloths
from muslin.sim.contact.patch_motion import SetMotion, approach, split_motions
from muslin.sim.contact.patches import GROUP_SIZE, PATCH_SIZE, cut_cloth, cut_collider, joined
from muslin.sim.material import load_fabric


@wp.kernel
def approach_of_two(motion: SetMotion, out: wp.array(dtype=wp.float64)):
    out[0] = approach(motion, 0, 1)


@pytest.fixture
def layers(grid_mesh):
    """Two layers of cloth 5 mm apart over a collider of another grid."""
    mesh = grid_mesh(14, 11, 0.02)
    flat = np.insert(mesh.panel_vertices, 1, 0.0, axis=1)
    sheet = build_cloth(mesh, load_fabric("gray-interlock"))
    above = np.array([0.0, 0.005, 0.0])
    points = np.concatenate([flat, flat + above, flat - above])
    return points, merge_cloths([sheet, sheet]), mesh.faces.astype(np.int32)


def test_every_primitive_is_in_one_group_and_touched_by_its_set(layers):
    points, cloth, faces = layers
    patches = _cut(points, cloth, faces)
    joint = np.concatenate([cloth.faces, faces + cloth.num_vertices])
    for rows, expected in (
        (patches.vertices.rows, np.arange(len(points))[:, None]),
        (patches.faces.rows, joint),
    ):
        np.testing.assert_array_equal(np.unique(rows, axis=0), np.unique(expected, axis=0))
        assert len(rows) == len(expected)
    assert len(np.unique(patches.edges.rows, axis=0)) == len(patches.edges.rows) == 3 * len(cloth.edges) // 2
    sizes = np.diff(patches.vertices.offsets)
    assert sizes.max() <= GROUP_SIZE
    assert np.add.reduceat(sizes, patches.groups[:-1]).max() <= PATCH_SIZE
    for g in range(len(sizes)):
        touched = set(_rows(patches.touched_by_group, g).ravel())
        for part in (patches.vertices, patches.edges, patches.faces):
            assert set(_rows(part, g).ravel()) <= touched
    assert touched <= set(_rows(patches.touched_by_patch, patches.count - 1).ravel())


def test_layers_and_collider_share_no_patch(layers):
    points, cloth, faces = layers
    patches = _cut(points, cloth, faces)
    heights = [points[_rows(patches.touched_by_patch, k)[:, 0], 1] for k in range(patches.count)]
    assert all(np.ptp(height) == 0.0 for height in heights)
    assert all((height >= 0.0).all() for height in heights[: patches.num_cloth])
    assert all((height < 0.0).all() for height in heights[patches.num_cloth :])


def test_pieces_smaller_than_a_patch_go_together(flat_mesh):
    draw = np.random.default_rng(3)
    faces = np.arange(90, dtype=np.int32).reshape(-1, 3)
    cloth = build_cloth(flat_mesh(draw.uniform(size=(90, 2)), faces), load_fabric("gray-interlock"))
    patches = _cut(draw.uniform(size=(90, 3)), cloth, faces[:0])
    assert patches.count <= 90 // (PATCH_SIZE // 2)


def _rows(part, k: int) -> np.ndarray:
    return part.rows[part.offsets[k] : part.offsets[k + 1]]


@pytest.mark.parametrize("seed", range(20))
def test_points_come_together_by_no_more_than_is_said(seed):
    """Two clouds, nearly rigid, on a common motion: for every pair of points and every part of the way."""
    draw = np.random.default_rng(seed)
    points = (
        np.concatenate([draw.normal(size=(12, 3)), draw.normal(size=(9, 3)) + draw.normal(size=3)]) * 0.03
    )
    common = np.cross(draw.normal(size=3), points) + draw.normal(size=3)
    own = np.cross(draw.normal(size=3), points) * (np.arange(21) >= 12)[:, None]
    moves = (
        common + 10.0 ** draw.uniform(-3, 0) * own + 10.0 ** draw.uniform(-4, -1) * draw.normal(size=(21, 3))
    )
    bound, rigid = measured_approach(points, moves), measured_approach(points, common)
    a, b = points[:12, None], points[None, 12:]
    for share in (0.1, 0.5, 1.0):
        moved = points + share * moves
        before = np.linalg.norm(a - b, axis=2)
        after = np.linalg.norm(moved[:12, None] - moved[None, 12:], axis=2)
        assert (before - after).max() <= share * bound * (1.0 + 1e-12)
    # The shifts of the two sets differ by metres, what they do not share by next to nothing.
    assert rigid < 1e-5 * np.linalg.norm(common, axis=1).max()


@pytest.mark.parametrize("seed", range(10))
def test_points_come_near_a_large_set_at_rest_by_no_more_than_is_said(seed):
    """A cloud turns and falls beside a floor of some metres, whose centre is elsewhere."""
    draw = np.random.default_rng(seed)
    floor = np.array([[-2.0, 0, -1], [-1, 0, 4], [6, 0, 5], [7, 0, -5]])
    spread = np.concatenate([floor, 0.5 * (floor + np.roll(floor, 1, axis=0)), floor.mean(axis=0)[None]])
    points = np.concatenate([0.03 * draw.normal(size=(12, 3)) + [0.5, 0.1, 0.2], spread])
    moves = np.cross(draw.normal(size=3), points - points[0]) + 0.1 * draw.normal(size=3)
    moves[12:] = 0.0
    bound = measured_approach(points, moves)
    before = np.linalg.norm(points[:12, None] - points[None, 12:], axis=2)
    after = np.linalg.norm((points + moves)[:12, None] - points[None, 12:], axis=2)
    assert (before - after).max() <= bound * (1.0 + 1e-12)
    assert moves[:12, 1].min() >= -bound * (1.0 + 1e-12), "the way down to the plane itself"


def measured_approach(points: np.ndarray, moves: np.ndarray) -> float:
    motion = SetMotion()
    for name in ("centre", "mean", "spin"):
        setattr(motion, name, wp.zeros(2, dtype=wp.vec3d, device="cpu"))
    for name in ("rest", "spread", "radius", "way"):
        setattr(motion, name, wp.zeros(2, dtype=wp.float64, device="cpu"))
    motion.changed = wp.zeros(2, dtype=wp.int32, device="cpu")
    offsets = wp.array([0, 12, 21], dtype=wp.int32, device="cpu")
    touched = wp.array(np.arange(21)[:, None], dtype=wp.int32, ndim=2, device="cpu")
    x, p = (wp.array(values, dtype=wp.vec3d, device="cpu") for values in (points, moves))
    motion.radius.fill_(-1.0)
    whole = wp.ones(21, dtype=wp.float64, device="cpu")
    wp.launch(split_motions, 2, [offsets, touched, x, p, False, whole, motion], device="cpu")
    out = wp.zeros(1, dtype=wp.float64, device="cpu")
    wp.launch(approach_of_two, 1, [motion, out], device="cpu")
    return float(out.numpy()[0])


def _cut(points, cloth, collider_faces):
    n = cloth.num_vertices
    return joined(cut_cloth(points[:n], cloth), cut_collider(points[n:], collider_faces), n)
