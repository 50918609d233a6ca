"""Scenes of scenes/remesh/ that remesh while they move, at reduced size: what they expect must hold, nothing
may cross, no edge may be longer than the metric allows after any remeshing, and triangles are small where the
cloth folds.

Reduced means coarse triangles, a time step a frame and the first part of the motion, to which `frames` is
brought.
"""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from muslin.garments.mesh import GarmentMesh
from muslin.sim.dataset.sample import Sample
from muslin.sim.dataset.verify import verify_sample
from muslin.sim.expect import check_expectations
from muslin.sim.remesh import in_loop
from muslin.sim.remesh.adapt import Changes
from muslin.sim.remesh.obstacle import Obstacle
from muslin.sim.remesh.sewn_mesh import GarmentState
from muslin.sim.run import simulate
from muslin.sim.scene import Scene, load_scene
from tests.sim.remesh.adapted import adapted, check_conserved, check_sizes

Array = NDArray[np.float64]

FOLDER = Path(__file__).resolve().parents[2] / "scenes" / "remesh"
REDUCED = {
    "sphere": ("remesh.refine_angle=0.4", "remesh.size_min=0.02", "sequence.duration=0.8"),
    "twist": ("remesh.size_min=0.03", "garment.edge_length=0.05"),
    # As much more may turn from end to end of an edge as edges are longer.
    "dress": (
        "remesh.refine_angle=0.9",
        "remesh.refine_compression=0.015",
        "remesh.size_min=0.045",
        "remesh.size_max=0.15",
        "garment.edge_length=0.065",
        "motion.end=0.1",
        "solver.settle_steps=6",
    ),
}
TIME_STEP = 0.034


def test_all_scenes_are_here() -> None:
    in_motion = set()
    for path in FOLDER.glob("*.toml"):
        with path.open("rb") as file:
            if "remesh" in tomllib.load(file):
                in_motion.add(path.stem)
    assert in_motion == set(REDUCED)


def checked_adapt(
    state: GarmentState, metric: Array, obstacle: Obstacle, aspect_min: float
) -> tuple[GarmentState, NDArray[np.int32], Changes]:
    """`adapt`, and what has to hold after it."""
    done = adapted(state, metric, (obstacle.vertices, obstacle.faces), aspect_min)
    check_sizes(done)
    check_conserved(done.before, done.after)
    return done.after, done.origin, done.changes


@cache
def played(name: str) -> tuple[Scene, Sample]:
    scene = load_scene(FOLDER / f"{name}.toml", [*REDUCED[name], f"solver.dt={TIME_STEP}"])
    if scene.sequence is not None:
        frames = round(scene.sequence.duration * scene.sequence.fps) + 1
    else:
        assert scene.motion is not None
        assert scene.motion.end is not None
        frames = round(scene.motion.end * scene.motion.fps) + 1
    scene = scene.model_copy(update={"expect": scene.expect.model_copy(update={"frames": frames})})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(in_loop, "adapt", checked_adapt)
        return scene, simulate(scene)


@pytest.mark.parametrize("name", REDUCED)
def test_scene_keeps_what_it_expects(name: str) -> None:
    scene, sample = played(name)
    assert check_expectations(scene, sample) == []
    finding = verify_sample(sample.validate())
    assert finding.reason == ""
    assert (finding.cloth_cloth, finding.cloth_body, finding.frames) == (0, 0, sample.num_frames)
    for key in ("splits", "flips", "collapses"):
        assert sample.certificate.extra[key] > 0


def bending(mesh: GarmentMesh, positions: Array) -> Array:
    """(F,) largest of the angles across the edges of a face over the distance of the centroids, 1/m."""
    half = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]])
    key = np.sort(half, axis=1).astype(np.int64) @ np.array([mesh.num_vertices, 1])
    order = np.argsort(key, kind="stable")
    pair = np.flatnonzero(key[order][1:] == key[order][:-1])
    one, other = order[pair] % len(mesh.faces), order[pair + 1] % len(mesh.faces)
    a, b, c = positions[mesh.faces].swapaxes(0, 1)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    centre = (a + b + c) / 3.0
    angle = np.arccos(np.clip((normal[one] * normal[other]).sum(axis=1), -1.0, 1.0))
    curved = angle / np.linalg.norm(centre[one] - centre[other], axis=1)
    found = np.zeros(len(mesh.faces))
    np.maximum.at(found, one, curved)
    np.maximum.at(found, other, curved)
    return found


@pytest.mark.parametrize(("name", "ratio"), [("sphere", 0.5), ("dress", 0.6)])
def test_triangles_are_small_where_cloth_folds(name: str, ratio: float) -> None:
    """Of the quarter of the cloth that is bent most, against that which is bent least."""
    _, sample = played(name)
    last = sample.num_frames - 1
    mesh = sample.frame_garment(last)
    order = np.argsort(bending(mesh, sample.frame_positions(last).astype(np.float64)))
    share = np.cumsum(mesh.face_areas[order]) / mesh.face_areas.sum()
    flat, folded = order[share < 0.25], order[share > 0.75]
    assert mesh.face_areas[folded].mean() < ratio * mesh.face_areas[flat].mean()


def test_a_twisted_strip_gets_more_triangles_with_every_turn() -> None:
    _, sample = played("twist")
    counts = [len(sample.frame_garment(frame).faces) for frame in range(0, sample.num_frames, 30)]
    assert (np.diff(counts) > 0).all()
    assert counts[-1] > 3 * counts[0]
