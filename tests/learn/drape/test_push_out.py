from functools import partial

import igl
import numpy as np
import pytest

from muslin.garments.template import template
from muslin.learn.drape.body_surface import BodySurface
from muslin.learn.drape.push_out import CLEARANCE, LENGTH, PushOut
from muslin.learn.drape.smoothing import sewn_operators, smoothing_matrix
from muslin.learn.drape.world import World
from muslin.sim.body.load import load_body
from muslin.sim.wear import a_pose

BETA = [0.8]


@pytest.fixture(scope="module")
def body() -> BodySurface:
    model = load_body("female")
    return BodySurface(World("tee", "female", model.digest, a_pose().tolist(), ("gray-interlock",)))


@pytest.fixture(scope="module")
def mesh():
    return template("tee", resolution=1400)


@pytest.fixture(scope="module")
def pressed(body: BodySurface, mesh) -> np.ndarray:
    """A sheet of cloth before the chest, some of it pressed up to 4 mm into it."""
    flat = np.zeros((mesh.num_vertices, 3))
    panel = mesh.panel_to_vertex
    flat[panel, :2] = 0.5 * (np.asarray(mesh.panel_vertices) - np.mean(mesh.panel_vertices, axis=0))
    flat[:, 1] += 0.1
    before = body.vertices(BETA)
    covered = before[(np.abs(before[:, :2]) < np.abs(flat[:, :2]).max(0)).all(1)]
    flat[:, 2] = covered[:, 2].max() - 0.004
    return flat


def test_all_is_outside_and_what_is_far_stays(body: BodySurface, mesh, pressed: np.ndarray) -> None:
    before, *_ = body.nearest(pressed, BETA)
    inside = before < 0.0
    assert 5 < inside.sum() < 200
    moved = PushOut(mesh)(pressed, partial(body.nearest, beta=BETA))
    winding = igl.fast_winding_number(body.vertices(BETA), body.faces, moved)
    assert (winding < 0.5).all()
    after, *_ = body.nearest(moved, BETA)
    np.testing.assert_allclose(after[inside], CLEARANCE, atol=5e-4)
    step = np.linalg.norm(moved - pressed, axis=1)
    assert step.max() < 0.02
    seen = np.linalg.norm(pressed[:, None] - pressed[inside][None], axis=2).min(1)
    assert np.median(step[seen > 0.15]) < 2e-4
    # What is beside the vertices that were inside comes along, in a smooth bump.
    near = (seen > 0.0) & (seen < 0.01)
    assert step[near].min() > 1e-4


def test_cloth_that_is_outside_is_left_alone(body: BodySurface, mesh, pressed: np.ndarray) -> None:
    away = pressed + np.array([0.0, 0.0, 0.05])
    assert np.array_equal(PushOut(mesh)(away, partial(body.nearest, beta=BETA)), away)


def test_it_is_the_least_displacement(body: BodySurface, mesh, pressed: np.ndarray) -> None:
    moved = PushOut(mesh)(pressed, partial(body.nearest, beta=BETA))
    matrix = smoothing_matrix(*sewn_operators(mesh), LENGTH)
    forces = np.linalg.norm(matrix @ (moved - pressed), axis=1)
    before, *_ = body.nearest(pressed, BETA)
    # Only vertices that were inside, or were brought there, are held: nothing pulls at any other.
    held = forces > 1e-6 * forces.max()
    assert held[before < 0.0].all()
    assert held.sum() < (before < 0.0).sum() + 0.1 * len(held)
