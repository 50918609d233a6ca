"""Safe steps: never past a contact that ipctk's tight inclusion finds, and no shorter than they must be."""

import ipctk
import numpy as np
import pytest
import warp as wp

from muslin.sim.cloth import build_cloth
from muslin.sim.contact.ccd import GAP, largest_safe_step
from muslin.sim.contact.system import ContactSettings, ContactSystem
from muslin.sim.dataset.intersections import count_intersections
from muslin.sim.material import load_fabric


def safe_step(points, moves, is_edge_edge: bool, limit: float = 1.0) -> float:
    x, p = (wp.array(np.asarray(values, float), dtype=wp.vec3d, device="cpu") for values in (points, moves))
    pairs = wp.array(np.arange(4, dtype=np.int32)[None], dtype=wp.vec4i, device="cpu")
    step = wp.array([limit], dtype=wp.float64, device="cpu")
    wp.launch(largest_safe_step, 1, [x, p, pairs, is_edge_edge, step], device="cpu")
    return float(step.numpy()[0])


def first_contact(points, moves, is_edge_edge: bool) -> float | None:
    """Time of impact in [0, 1] by ipctk, or None."""
    ends = points + moves
    if is_edge_edge:
        hit, time = ipctk.TightInclusionCCD().edge_edge_ccd(*points, *ends)
    else:
        hit, time = ipctk.TightInclusionCCD().point_triangle_ccd(*points, *ends)
    return time if hit else None


def random_moves(count: int, seed: int, scale: float) -> tuple[np.ndarray, np.ndarray]:
    draw = np.random.default_rng(seed)
    points = draw.normal(size=(count, 4, 3))
    # Turning, shearing, and a common motion far larger than any of it.
    common = 10.0 * draw.normal(size=(count, 1, 3))
    return points, scale * draw.normal(size=(count, 4, 3)) + common


@pytest.mark.parametrize("is_edge_edge", [False, True])
@pytest.mark.parametrize("scale", [0.1, 1.0, 5.0])
def test_step_ends_before_the_contact_that_ipctk_finds(closest, is_edge_edge, scale):
    points, moves = random_moves(300, 1 + is_edge_edge, scale)
    start = closest(points, is_edge_edge)[1]
    steps = np.array([safe_step(x, p, is_edge_edge) for x, p in zip(points, moves, strict=True)])
    contacts = [first_contact(x, p, is_edge_edge) for x, p in zip(points, moves, strict=True)]
    hit = np.array([time is not None for time in contacts])
    times = np.array([time if time is not None else np.inf for time in contacts])
    assert (steps > 0).all()
    assert (steps[hit] < times[hit]).all()
    for share in np.linspace(0, 1, 21):
        distance = closest(points + share * steps[:, None, None] * moves, is_edge_edge)[1]
        assert (distance >= GAP * start * (1 - 1e-6)).all()
    # Not absurdly small: no less than what the fastest points alone would allow, whole where all is clear.
    relative = moves - moves.mean(axis=1, keepdims=True)
    speed = np.linalg.norm(relative, axis=2)
    sides = ([0, 1], [2, 3]) if is_edge_edge else ([0], [1, 2, 3])
    reach = sum(speed[:, side].max(axis=1) for side in sides)
    assert (steps >= np.minimum(1.0, (1 - GAP) * start / reach) * (1 - 1e-9)).all()
    if scale == 0.1:
        assert np.median(steps[~hit]) == 1.0
    else:
        assert hit.sum() > 10


@pytest.mark.parametrize("speed", [1.0, 1e3])
@pytest.mark.parametrize("height", [1e-6, 1e-3, 1.0])
def test_head_on_it_goes_almost_to_the_gap(height, speed):
    triangle = [[-1, 0, -1], [1, 0, -1], [0, 0, 2]]
    moves = np.zeros((4, 3))
    moves[0, 1] = -height * speed * 2
    step = safe_step([[0, height, 0], *triangle], moves, False)
    np.testing.assert_allclose(step, (1 - GAP) / (2 * speed), rtol=1e-9)
    edges = [[-1, height, 0], [1, height, 0], [0, 0, -1], [0, 0, 1]]
    moves[1] = moves[0]
    np.testing.assert_allclose(safe_step(edges, moves, True), (1 - GAP) / (2 * speed), rtol=1e-9)


@pytest.mark.parametrize(
    "moves",
    [
        [[0, 1, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]],
        [[0.05, 0, 0.02], [0, 0, 0], [0, 0, 0], [0, 0, 0]],
        [[5, -3, 2], [5, -3, 2], [5, -3, 2], [5, -3, 2]],
        [[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]],
        [[0, -7.999e-4, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]],
    ],
    ids=["away", "sliding", "together", "still", "just not too near"],
)
def test_whole_step_where_nothing_comes_too_near(moves):
    points = [[0, 1e-3, 0], [-1, 0, -1], [1, 0, -1], [0, 0, 2]]
    assert safe_step(points, moves, False) == 1.0


def test_a_shorter_limit_is_kept():
    points = [[0, 1e-3, 0], [-1, 0, -1], [1, 0, -1], [0, 0, 2]]
    moves = [[0, -1e-3, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]]
    assert safe_step(points, moves, False, limit=0.3) == 0.3


@pytest.mark.parametrize("seed", range(4))
def test_whole_meshes_step_without_collision(grid_mesh, seed):
    """A sheet between two waves of a collider, thrown about: the step is free of collisions by ipctk."""
    draw = np.random.default_rng(seed)
    mesh = grid_mesh(8, 8, 0.01)
    flat = np.insert(mesh.panel_vertices, 1, 0.0, axis=1)
    wave = flat + np.sin(60.0 * flat[:, :1]) * [0, 1e-3, 0]
    apart = np.array([0, 3e-3, 0])
    body = np.concatenate([wave - apart, wave + apart])
    body += 1e-4 * draw.normal(size=body.shape)
    cloth = wave + 1e-4 * draw.normal(size=flat.shape)
    faces = np.concatenate([mesh.faces, mesh.faces + len(flat)])
    points = np.concatenate([cloth, body])
    contact = ContactSystem(
        build_cloth(mesh, load_fabric("gray-interlock")), faces, points, ContactSettings(), "cpu"
    )
    move = 0.01 * draw.normal(size=points.shape)
    x, p = (wp.array(values, dtype=wp.vec3d, device="cpu") for values in (points, move))
    contact.search.renew(x)
    contact.search.cover(x, p)
    step = contact.largest_step(x, p, wp.zeros(1, dtype=wp.float64, device="cpu"))
    assert 1e-3 < step < 1.0

    joint = np.concatenate([mesh.faces, faces + len(flat)]).astype(np.int32)
    whole = ipctk.CollisionMesh(points, ipctk.edges(joint), joint)
    whole.can_collide = ipctk.make_static_obstacle_filter(len(flat))
    assert ipctk.is_step_collision_free(whole, points, points + step * move)
    assert not ipctk.is_step_collision_free(whole, points, points + move)
    moved = points + step * move
    counts = count_intersections(moved[: len(flat)], mesh.faces, moved[len(flat) :], faces)
    assert (counts.cloth_cloth, counts.cloth_body) == (0, 0)


def test_moves_cut_vertex_by_vertex_are_safe_and_leave_far_vertices_alone(make_soup, closest):
    """Triangles stacked 1 mm apart fall on the lowest, which is still; one far away falls freely."""
    count = 6
    heights = np.array([0.0, 1.0, 2.0, 3.0, 4.0, 500.0]) * 1e-3
    triangle = np.array([[0.0, 0.0, 0.0], [0.02, 0.0, 0.0], [0.0, 0.0, 0.02]])
    points = (triangle + np.insert(np.zeros((count, 1, 2)), 1, heights[:, None], axis=2)).reshape(-1, 3)
    moves = np.zeros_like(points)
    moves[3:, 1] = -0.01
    soup = make_soup(count, 0)
    soup.search(points, moves)
    x, p, step = soup.array(points), soup.array(moves), wp.zeros(1, dtype=wp.float64, device="cpu")
    share = soup.contact.cut_to_safety(x, p, step)
    cut = p.numpy()
    assert 0.5 < share <= 1.0
    np.testing.assert_array_equal(cut[-3:], moves[-3:])
    assert (np.abs(cut[3:-3, 1]) > 1e-5).all()
    assert (np.abs(cut[3:-3, 1]) < 4e-3).all()
    nothing = np.zeros((0, 3)), np.zeros((0, 3), int)
    for t in np.linspace(0.0, share, 11):
        found = count_intersections(points + t * cut, np.arange(3 * count).reshape(-1, 3), *nothing)
        assert found.cloth_cloth == 0
    layers = (points + share * cut)[:, 1].reshape(count, 3)
    assert (np.diff(layers, axis=0) > 0.0).all()


def test_what_is_cut_falls_back_on_the_base(make_soup):
    """Two sheets carried along by 5 cm, one flying into the other: both keep the motion they share."""
    triangle = np.array([[0.0, 0.0, 0.0], [0.02, 0.0, 0.0], [0.0, 0.0, 0.02]])
    points = np.concatenate([triangle, triangle + np.array([0.0, 1e-3, 0.0])])
    base = np.tile([0.05, 0.0, 0.0], (6, 1))
    moves = base.copy()
    moves[3:, 1] = -0.01
    soup = make_soup(2, 0)
    x, p, b = soup.array(points), soup.array(moves), soup.array(base)
    soup.search(points, moves)
    share = soup.contact.cut_to_safety(x, p, wp.zeros(1, dtype=wp.float64, device="cpu"), b)
    assert share == 1.0
    np.testing.assert_array_equal(p.numpy()[:, [0, 2]], base[:, [0, 2]])
    assert (p.numpy()[3:, 1] > -1e-3).all()
    assert (p.numpy()[3:, 1] < -1e-4).all()
