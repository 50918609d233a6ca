"""Two spheres as one mesh: the collider makes room where they overlap, and is the body where they do not."""

import igl
import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from muslin.sim.body import load_body
from muslin.sim.body.interior import MASK_GAP_M, interior_points, masked_face_is_interior
from muslin.sim.contact.clearance import LIMB, ROOM, SelfClearance, _in_reach, room_for
from muslin.sim.dataset.intersections import count_intersections

RADIUS = 0.1
BALL = trimesh.creation.icosphere(4, RADIUS)
ANGLE, SPAN = (grid.ravel() for grid in np.meshgrid(np.linspace(0, 6.2, 80), np.linspace(0, 0.09, 19)))
CLOTH = np.stack([0.0 * SPAN, SPAN * np.cos(ANGLE), SPAN * np.sin(ANGLE)], axis=1)
"""A disc between the spheres."""


def two_spheres(gap: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of two spheres, left first, `gap` apart (negative: overlapping) along x."""
    far = np.array([RADIUS + 0.5 * gap, 0, 0])
    turn = trimesh.transformations.rotation_matrix(0.7, [1, 2, 3])[:3, :3]
    vertices = np.concatenate([BALL.vertices - far, BALL.vertices @ turn.T + far])
    return vertices, np.concatenate([BALL.faces, BALL.faces + len(BALL.vertices)]).astype(np.int32)


def room_between(collider: np.ndarray, faces: np.ndarray) -> float:
    """Smallest distance between the collider's two parts, metres."""
    n, m = len(BALL.vertices), len(BALL.faces)
    others = faces[m:].astype(np.int64) - n
    squared = igl.point_mesh_squared_distance(collider[:n], np.ascontiguousarray(collider[n:]), others)[0]
    return float(np.sqrt(squared.min()))


@pytest.mark.parametrize("gap", [0.5, 0.02, 2 * ROOM])
def test_spheres_apart_are_left_bit_for_bit(gap):
    vertices, faces = two_spheres(gap)
    clearance = SelfClearance(vertices, faces, "cpu")
    collider = clearance.collider(vertices, CLOTH).vertices
    assert collider.tobytes() == vertices.tobytes()
    assert len(clearance.changed_faces(vertices, collider)) == 0


@pytest.mark.parametrize("gap", [0.0, -0.002, -0.01, -0.03])
def test_overlapping_spheres_leave_room_for_cloth(gap):
    """A little less than `ROOM` where triangles as coarse as these meet: only faces fit to be masked move."""
    vertices, faces = two_spheres(gap)
    n, m = len(BALL.vertices), len(BALL.faces)
    clearance = SelfClearance(vertices, faces, "cpu")
    collider = clearance.collider(vertices, CLOTH).vertices
    counts = count_intersections(collider[:n], faces[:m], collider[n:], faces[m:] - n)
    assert (counts.cloth_cloth, counts.cloth_body) == (0, 0)
    assert room_between(collider, faces) > 0.75 * ROOM

    moved = (collider != vertices).any(axis=1)
    assert not interior_points(collider[n:], faces[m:] - n, collider[:n]).any()
    assert not interior_points(collider[:n], faces[:m], collider[n:]).any()
    assert 0 < moved.sum() < 0.5 * len(vertices)
    # Drawn inwards by half of the room and of the overlap, and evened out.
    assert np.linalg.norm(collider - vertices, axis=1).max() <= ROOM + 0.5 * -gap


@pytest.mark.parametrize("gap", [0.0, -0.01])
def test_without_cloth_nearby_the_collider_is_the_body(gap):
    vertices, faces = two_spheres(gap)
    far = CLOTH + np.array([0, 0.5, 0])
    collider = SelfClearance(vertices, faces, "cpu").collider(vertices, far).vertices
    assert collider.tobytes() == vertices.tobytes()


def test_cloth_that_a_moving_body_has_yet_to_carry_along_counts_as_near():
    vertices, faces = two_spheres(-0.01)
    clearance = SelfClearance(vertices, faces, "cpu")
    way = np.array([0.0, 0.5, 0.0])
    carried = clearance.collider(vertices + way, CLOTH, vertices).vertices
    here = clearance.collider(vertices, CLOTH).vertices
    np.testing.assert_allclose(carried - way, here, atol=1e-6)
    assert np.abs(carried - vertices - way).max() > 0.5 * ROOM


@pytest.mark.parametrize("gap", [0.0, -0.002, -0.01, -0.03])
def test_masked_faces_pass_the_test_of_the_verification(gap):
    vertices, faces = two_spheres(gap)
    clearance = SelfClearance(vertices, faces, "cpu")
    collider = clearance.collider(vertices, CLOTH).vertices
    masked = clearance.changed_faces(vertices, collider)
    assert len(masked) > 0
    assert masked.dtype == np.int32
    assert masked_face_is_interior(vertices, faces, masked, MASK_GAP_M).all()
    # Every face that the collider shows differently is masked: no cloth can get behind an unmasked one.
    touched = np.flatnonzero((np.abs(vertices - collider) > 1e-8).any(axis=1)[faces].any(axis=1))
    assert set(touched) == set(masked.tolist())


def test_collider_moves_smoothly_as_the_spheres_meet():
    gaps = np.linspace(0.012, -0.012, 49)
    clearance = SelfClearance(*two_spheres(1.0), "cpu")
    colliders = []
    for gap in gaps:
        vertices, _ = two_spheres(gap)
        colliders.append(clearance.collider(vertices, CLOTH).vertices)
    step = np.abs(np.diff(gaps)).max()
    jumps = np.linalg.norm(np.diff(colliders, axis=0), axis=2)
    assert jumps.max() < 12 * step, "no vertex may leap: cloth could not follow"


@pytest.mark.parametrize("hip", [1.6, 2.0, 2.3])
def test_skin_folded_into_a_crouching_body_is_drawn_apart(hip):
    """Thighs deep in the belly, normals anywhere: of hundreds of vertices inside, a handful stays inside."""
    body = load_body("female")
    theta = np.zeros((24, 3))
    theta[[1, 2], 0] = -hip
    theta[[3, 6], 0] = 0.3 * hip - 0.3
    vertices, faces = body.vertices(np.zeros(2), theta), body.faces.astype(np.int64)
    cloth = vertices + 3e-3 * igl.per_vertex_normals(vertices, faces)
    rest = body.vertices(np.zeros(2), np.zeros((24, 3)))
    collider = SelfClearance(rest, body.faces, "cpu", 6e-3).collider(vertices, cloth).vertices
    moved = np.abs(collider - vertices).max(axis=1) > 0.0

    def inside(surface):
        above = surface + 4e-4 * igl.per_vertex_normals(surface, faces)
        return int(interior_points(surface, faces, above[moved]).sum())

    assert inside(vertices) > 100
    assert inside(collider) <= max(8, 0.03 * inside(vertices))


def test_near_a_crease_the_collider_may_give_way():
    """All that may differ from the body, moved or giving way, is fit to be masked; nothing else may."""
    vertices, faces = two_spheres(-0.01)
    body = SelfClearance(vertices, faces, "cpu").collider(vertices, CLOTH)
    moved = (body.vertices != vertices).any(axis=1)
    assert (body.yielding >= moved).all()
    assert moved.sum() < body.yielding.sum() < 0.5 * len(vertices)
    touched = np.flatnonzero(body.yielding[faces].any(axis=1))
    assert masked_face_is_interior(vertices, faces, touched, MASK_GAP_M).all()
    assert not masked_face_is_interior(vertices, faces, np.arange(len(faces)), MASK_GAP_M).all()


def test_coarse_cloth_has_the_height_of_an_arc_over_its_edges_more_room():
    edge = 0.02
    triangles = np.full(7, np.sqrt(3.0) / 4.0 * edge**2)
    arc = LIMB - np.sqrt(LIMB**2 - 0.25 * edge**2)
    assert room_for(triangles) - ROOM == pytest.approx(arc, rel=0.1)
    vertices, faces = two_spheres(-0.01)
    n = len(BALL.vertices)
    gaps = []
    for room in (room_for(triangles), ROOM):
        collider = SelfClearance(vertices, faces, "cpu", room).collider(vertices, CLOTH).vertices
        middle = np.linalg.norm(vertices[:, 1:], axis=1) < 0.01
        left, right = collider[:n][middle[:n]], collider[n:][middle[n:]]
        gaps.append(right[:, 0].min() - left[:, 0].max())
    assert gaps[0] - gaps[1] == pytest.approx(room_for(triangles) - ROOM, rel=0.1)


def test_a_share_of_the_room_is_left():
    """Twice the room only as far as faces have the body in front of them."""
    vertices, faces = two_spheres(-0.01)
    clearance = SelfClearance(vertices, faces, "cpu")
    left = [
        room_between(clearance.collider(vertices, CLOTH, share=share).vertices, faces)
        for share in (0.5, 1.0, 2.0)
    ]
    assert left[1] > 1.3 * left[0]
    assert left[2] > 1.15 * left[1]


def test_no_point_in_reach_of_the_cloth_is_left_out():
    points = np.random.default_rng(0).uniform(-0.4, 0.4, (4000, 3))
    found = _in_reach(points, CLOTH, 0.07)
    near = cKDTree(CLOTH).query(points)[0]
    assert found[near < 0.07].all()
    assert not found[near > 0.07 * (1.0 + 4.0 / 3.0) * np.sqrt(3.0)].any()
