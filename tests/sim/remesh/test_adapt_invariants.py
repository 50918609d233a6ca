"""Remeshing in motion: what holds after each of thousands of random splits, flips and collapses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from muslin.garments.mesh import GarmentMesh
from muslin.sim.remesh.metric import with_eigenvalues
from muslin.sim.remesh.sewn_mesh import PINNED, GarmentState
from tests.sim.remesh.adapted import Adapted, adapted, check_adapted
from tests.sim.remesh.draped import DRAPED, NOBODY, Draped, flat_sheet, moving

Array = NDArray[np.float64]

OPERATIONS = 1000
MOST_ROUNDS = 8


def smooth_metric(mesh: GarmentMesh, rng: np.random.Generator, low: float, high: float) -> Array:
    """(P, 2, 2) 1/m^2: sizes from `low` to `high`, metres, by smooth fields of panel space, other ones in
    every panel, along axes that turn; shortest over longest no less than 0.3."""
    points = mesh.panel_vertices
    waves = rng.normal(0.0, 8.0, (3, 2)) @ points.T + rng.uniform(0.0, 6.0, (3, 1))
    waves += rng.uniform(0.0, 6.0, (3, len(mesh.panel_names)))[:, mesh.panel_vertex_panel]
    share = 0.5 + 0.5 * np.sin(waves)
    size = low * (high / low) ** share[0]
    across = np.maximum(size * 0.3 ** share[1], 0.3 * size)
    angle = np.pi * share[2]
    axis = np.stack([np.cos(2.0 * angle), np.sin(2.0 * angle)])
    tensor = np.array([[axis[0], axis[1]], [axis[1], -axis[0]]]).transpose(2, 0, 1)
    return with_eigenvalues(tensor, across**-2, size**-2)


def spacing(mesh: GarmentMesh) -> float:
    """Mean length of the edges in panel space, metres."""
    ends = mesh.panel_vertices[mesh.panel_faces]
    return float(np.linalg.norm(ends - np.roll(ends, 1, axis=1), axis=2).mean())


def lock_some(state: GarmentState, rng: np.random.Generator) -> GarmentState:
    """A tenth of the vertices have to stay, and a stretch of one boundary is led."""
    locked = (rng.random(state.mesh.num_vertices) < 0.1).astype(np.int32)
    loop = state.mesh.boundary_loops[0]
    locked[loop[: len(loop) // 4]] = int(PINNED)
    return replace(state, locked=locked)


def rounds(draped: Draped, seed: int) -> list[Adapted]:
    """Remeshings one after the other, fine and coarse by turns, until enough operations were made."""
    rng = np.random.default_rng(seed)
    state = lock_some(draped.state(seed), rng)
    edge = spacing(draped.mesh)
    done: list[Adapted] = []
    while sum(one.changes.total for one in done) < OPERATIONS:
        assert len(done) < MOST_ROUNDS
        low, high = (0.6 * edge, 1.5 * edge) if len(done) % 2 == 0 else (2.0 * edge, 6.0 * edge)
        metric = smooth_metric(state.mesh, rng, low, high)
        done.append(adapted(state, metric, draped.body))
        # From here on it moves as it likes.
        after = done[-1].after
        state = replace(after, velocities=moving(after.positions, rng))
    return done


@pytest.mark.parametrize("name", DRAPED)
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=2)
def test_a_thousand_operations_leave_a_garment_one(name: str, seed: int) -> None:
    done = rounds(DRAPED[name](seed % 1000), seed)
    for one in done:
        check_adapted(one)
    total = np.sum([(c.changes.splits, c.changes.flips, c.changes.collapses) for c in done], axis=0)
    assert (total > 0).all()
    assert total.sum() >= OPERATIONS


def test_splits_alone_leave_the_surface_as_it_is() -> None:
    """On flat cloth flips do as well: every vertex lies where its point of panel space did, and a velocity
    that is linear over the cloth stays the same field."""
    draped = flat_sheet(2)
    points = draped.mesh.panel_vertices
    frame = np.linalg.lstsq(np.insert(points, 2, 1.0, axis=1), draped.positions, rcond=None)[0]
    field = np.random.default_rng(0).normal(size=(3, 3))
    state = replace(draped.state(), velocities=draped.positions @ field)
    metric = np.tile(np.eye(2) / (0.2 * spacing(draped.mesh)) ** 2, (len(points), 1, 1))
    done = adapted(state, metric, NOBODY)
    check_adapted(done)
    assert done.changes.splits > OPERATIONS
    flat = done.after.mesh.panel_vertices[np.argsort(done.after.mesh.panel_to_vertex)]
    np.testing.assert_allclose(done.after.positions, np.insert(flat, 2, 1.0, axis=1) @ frame, atol=1e-14)
    np.testing.assert_allclose(done.after.velocities, done.after.positions @ field, atol=1e-13)


def test_the_same_input_gives_the_same_bytes() -> None:
    draped = DRAPED["waved annulus"](1)
    ends = []
    for _ in range(2):
        done = rounds(draped, 3)[-1].after
        arrays = (done.positions, done.velocities, done.mesh.panel_faces, done.mesh.uv, done.locked)
        ends.append([array.tobytes() for array in arrays])
    assert ends[0] == ends[1]


def test_a_mesh_that_is_fine_stays() -> None:
    """The second time there is nothing to split, and next to nothing else to do."""
    draped = DRAPED["waved annulus"](1)
    metric = np.tile(np.eye(2) / spacing(draped.mesh) ** 2, (len(draped.mesh.panel_vertices), 1, 1))
    first = adapted(draped.state(), metric, NOBODY)
    again = np.tile(metric[0], (len(first.after.mesh.panel_vertices), 1, 1))
    second = adapted(first.after, again, NOBODY)
    assert first.changes.splits > 100
    assert second.changes.splits == 0
    assert second.changes.total < 0.02 * first.changes.total
