"""The simulator among colliders: cloth that never passes through, friction that obeys Coulomb."""

import numpy as np
import pytest
import trimesh

from muslin.sim.cloth import build_cloth
from muslin.sim.contact.system import ContactSettings
from muslin.sim.dataset.intersections import count_intersections
from muslin.sim.material import load_fabric
from muslin.sim.solve.errors import SimulationError
from muslin.sim.solve.settings import SolverSettings
from muslin.sim.solve.simulator import ClothSimulator

GRAVITY = 9.81


def level(mesh, height: float) -> np.ndarray:
    """The flat mesh, level and centred, at a height."""
    flat = mesh.panel_vertices - mesh.panel_vertices.mean(axis=0)
    return np.stack([flat[:, 0], np.full(len(flat), height), -flat[:, 1]], axis=1)


def assert_apart(sim: ClothSimulator, collider_faces: np.ndarray) -> None:
    counts = count_intersections(sim.positions, sim.cloth.faces, sim.collider_vertices, collider_faces)
    assert (counts.cloth_cloth, counts.cloth_body) == (0, 0)


def test_sheet_dropped_on_a_sphere_never_intersects(grid_mesh):
    mesh = grid_mesh(9, 9, 0.04)
    ball = trimesh.creation.icosphere(3, 0.08)
    faces = np.asarray(ball.faces, np.int32)
    start = level(mesh, 0.09)
    start[:, 1] += 1e-3 * np.random.default_rng(0).normal(size=len(start))
    sim = ClothSimulator(build_cloth(mesh, load_fabric("gray-interlock")), start, ball.vertices, faces)
    sim.velocity[:] = [0.0, -2.0, 0.0]
    for _ in range(24):
        sim.advance(None, 1 / 60)
        assert_apart(sim, faces)
    assert sim.positions[:, 1].min() < 0.0, "hangs down around the sphere"
    assert sim.positions[:, 1].max() > 0.08, "is held by it"


def test_sphere_thrown_through_a_sheet_carries_it_along(grid_mesh):
    """The collider moves by its own size in a step: the cloth must come along, not be passed."""
    mesh = grid_mesh(8, 8, 0.04)
    ball = trimesh.creation.icosphere(3, 0.06)
    faces = np.asarray(ball.faces, np.int32)
    below = np.asarray(ball.vertices) - [0, 0.09, 0]
    sim = ClothSimulator(build_cloth(mesh, load_fabric("gray-interlock")), level(mesh, 0.0), below, faces)
    for k in range(1, 6):
        goal = below + np.array([0, 0.06 * k, 0])
        sim.advance(goal, 1 / 30)
        np.testing.assert_allclose(sim.collider_vertices, goal, atol=1e-12)
        assert_apart(sim, faces)
    centre = mesh.num_vertices // 2
    assert sim.positions[centre, 1] > 0.06 * 5 - 0.09 + 0.055


def test_folded_sheet_does_not_pass_through_itself(grid_mesh):
    """A sheet folded over falls onto its own lower half on a floor."""
    mesh = grid_mesh(4, 12, 0.02)
    flat = level(mesh, 0.0)
    along, radius = flat[:, 2] - flat[:, 2].min(), 0.012
    bend = 0.5 * along.max()
    angle = np.clip((along - bend) / radius, 0, np.pi)
    back = np.clip(along - bend - np.pi * radius, 0, None)
    folded = np.stack(
        [
            flat[:, 0],
            0.003 + radius * (1 - np.cos(angle)),
            np.minimum(along, bend) + radius * np.sin(angle) - back,
        ],
        axis=1,
    )
    floor = np.array([[-1.0, 0, -1], [-1, 0, 1], [1, 0, 1], [1, 0, -1]])
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    sim = ClothSimulator(build_cloth(mesh, load_fabric("gray-interlock")), folded, floor, faces)
    for _ in range(20):
        sim.advance(None, 1 / 60)
        assert_apart(sim, faces)
    assert np.ptp(sim.positions[:, 1]) < 2 * radius


def incline_speeds(grid_mesh, degrees: float, friction: float, steps: int, dt: float) -> np.ndarray:
    """Mean speed of a patch of cloth down the slope after each step; the floor is level, gravity leans."""
    mesh = grid_mesh(3, 3, 0.02)
    floor = np.array([[-5.0, 0, -3], [-5, 0, 4], [6, 0, 5], [7, 0, -5]])
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    slope = np.radians(degrees)
    settings = SolverSettings(
        gravity=(GRAVITY * np.sin(slope), -GRAVITY * np.cos(slope), 0.0),
        drag=0.0,
        tolerance=1e-8,
        max_iterations=30,
        linear_tolerance=1e-3,
    )
    contact = ContactSettings(friction_body=friction)
    sim = ClothSimulator(
        build_cloth(mesh, load_fabric("gray-interlock")), level(mesh, 0.96 * contact.range), floor, faces,
        contact, settings,
    )  # fmt: skip
    speeds = []
    for _ in range(steps):
        sim.advance(None, dt)
        speeds.append(sim.velocity[:, 0].mean())
        assert_apart(sim, faces)
    return np.array(speeds)


@pytest.mark.parametrize("degrees", [5.0, 14.0])
def test_patch_sticks_below_the_angle_of_friction(grid_mesh, degrees):
    """atan(0.3) is 16.7 degrees. The patch gives way by less than `slip`, and stays there."""
    speeds = incline_speeds(grid_mesh, degrees, 0.3, 60, 0.01)
    assert abs(speeds).max() < ContactSettings().slip / 0.01
    assert abs(speeds[-10:]).max() < 1e-5
    assert 0.01 * speeds.sum() < ContactSettings().slip


@pytest.mark.parametrize(("degrees", "friction"), [(25.0, 0.3), (40.0, 0.3), (30.0, 0.0), (40.0, 0.5)])
def test_patch_slides_with_coulombs_acceleration(grid_mesh, degrees, friction):
    slope = np.radians(degrees)
    speeds = incline_speeds(grid_mesh, degrees, friction, 30, 0.01)
    expected = GRAVITY * (np.sin(slope) - friction * np.cos(slope))
    np.testing.assert_allclose((speeds[-1] - speeds[9]) / 0.2, expected, rtol=0.1)


@pytest.mark.parametrize("yielding", [False, True])
def test_plates_that_would_meet_in_cloth_stop_only_where_they_may_yield(grid_mesh, yielding):
    """The upper plate is told to go 2 mm below the lower one, with cloth between, then up again."""
    plate = grid_mesh(4, 4, 0.05)
    low, high = level(plate, 0.0), level(plate, 0.006)
    faces = np.concatenate([plate.faces, plate.faces[:, ::-1] + len(low)]).astype(np.int32)
    mesh = grid_mesh(5, 5, 0.02)
    sim = ClothSimulator(
        build_cloth(mesh, load_fabric("gray-interlock")),
        level(mesh, 0.003),
        np.concatenate([low, high]),
        faces,
    )
    sim.yielding[len(low) :] = yielding
    goal = np.concatenate([low, level(plate, -0.002)])
    if not yielding:
        with pytest.raises(SimulationError, match="cannot go on without touching"):
            sim.advance(goal, 1 / 60)
        return
    for _ in range(3):
        sim.advance(goal, 1 / 60)
        assert_apart(sim, faces)
    np.testing.assert_allclose(sim.collider_vertices[: len(low)], low, atol=1e-12)
    heights = sim.collider_vertices[len(low) :, 1]
    middle = np.linalg.norm(low, axis=1) < 0.03
    assert middle.any()
    assert (heights[middle] > 0.0).all()
    assert (heights[middle] < 0.005).all(), "it goes as far as the cloth lets it"
    sim.advance(np.concatenate([low, high]), 1 / 60)
    np.testing.assert_allclose(sim.collider_vertices[len(low) :], high, atol=1e-12)
    assert_apart(sim, faces)


@pytest.mark.parametrize("seed", range(3))
def test_sheet_dropped_on_edge_stays_above_a_wide_floor(grid_mesh, seed):
    """A floor at rest whose triangles are a hundred times those of the cloth, which tumbles."""
    mesh = grid_mesh(9, 9, 0.04)
    flat = mesh.panel_vertices - mesh.panel_vertices.mean(axis=0)
    wavy = 0.01 * np.sin(20.0 * flat[:, 1]) + 1e-3 * np.random.default_rng(seed).normal(size=len(flat))
    floor = np.array([[-5.0, -0.19, -3], [-5, -0.19, 4], [6, -0.19, 5], [7, -0.19, -5]])
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    start = np.stack([flat[:, 0], flat[:, 1], wavy], axis=1)
    sim = ClothSimulator(build_cloth(mesh, load_fabric("gray-interlock")), start, floor, faces)
    for _ in range(15):
        sim.advance(None, 1 / 30)
        assert_apart(sim, faces)
    assert np.ptp(sim.positions[:, 1]) < 0.3
