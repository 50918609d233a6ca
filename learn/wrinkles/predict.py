"""Predicted sequences in the form of simulated ones."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.learn.drape.body_surface import nearest_on
from muslin.learn.drape.push_out import PushOut
from muslin.learn.wrinkles.clips import Told, told_of
from muslin.learn.wrinkles.condition import Condition
from muslin.learn.wrinkles.garment import GarmentCache, UnposedGarment
from muslin.learn.wrinkles.world import SequenceWorld
from muslin.sim.body_motion import body_track
from muslin.sim.dataset.certificate import Certificate
from muslin.sim.dataset.reader import Dataset, write_dataset
from muslin.sim.dataset.root import Root
from muslin.sim.dataset.sample import BodyTrack, Sample
from muslin.sim.scene import Scene
from muslin.sim.setting import cut_garment, garments_of


class Animator(Protocol):
    """Anything that draws maps of sequences: a `WrinkleModel`, and what it is compared with."""

    @property
    def world(self) -> SequenceWorld: ...

    @property
    def condition(self) -> Condition: ...

    @property
    def garments(self) -> GarmentCache: ...

    def maps(self, sequences: Sequence[Told], seed: int = 0) -> list[NDArray[np.float32]]:
        """(T, N, 3), metres, of each sequence."""


def predict_sequences(
    animator: Animator,
    truth: Dataset,
    out: str | Path | Root,
    *,
    seed: int = 0,
    push_out: bool = False,
    batch: int = 16,
    progress: Callable[[float, int, str], None] | None = None,
) -> Dataset:
    """A prediction for every sequence of `truth`, under its id and on its triangulation, as a dataset.

    Of a sample its garment, body, motion and fabric are looked at, not its positions. push_out: see
    `PushOut`. The certificate's seconds are those of the whole way from motion to positions.
    Raises InputError for what was not learned: another family or body, another rate, an unknown fabric.
    """
    made: list[Sample] = []
    for first in range(0, len(truth), batch):
        samples = [truth[row["id"]] for row in truth.rows[first : first + batch]]
        tracks = [animator.world.check(sample) for sample in samples]
        garments = [animator.garments.of(sample.frame_garment(0)) for sample in samples]
        begun = time.perf_counter()
        fabrics = [sample.fabric for sample in samples]
        found = _positions(animator, garments, tracks, fabrics, seed, push_out)
        each = (time.perf_counter() - begun) / sum(map(len, found))
        for sample, positions in zip(samples, found, strict=True):
            certificate = Certificate(seconds=each * len(positions), extra={"prediction_of": sample.id})
            made.append(replace(sample, positions=positions, certificate=certificate))
        if progress is not None:
            progress(first + len(samples), len(truth), samples[-1].id)
    return write_dataset(out, made, config={"name": "prediction", "of": str(truth.root)})


def predict_scene(animator: Animator, scene: Scene, *, seed: int = 0, push_out: bool = False) -> Sample:
    """The garment of a scene on its moving body. Raises InputError for what was not learned."""
    if scene.motion is not None and scene.motion.fps != animator.world.fps:
        raise InputError(
            f"scene {scene.name}: motion.fps = {scene.motion.fps:g}; the model learned from "
            f"{animator.world.fps:g} frames a second: add --set motion.fps={animator.world.fps:g}"
        )
    track, fabric = body_track(scene), garments_of(scene)[0].fabric.name
    mesh = cut_garment(scene)
    sample = Sample(
        scene.name, "sequence", mesh, np.zeros((len(track.poses), mesh.num_vertices, 3), np.float32),
        Certificate(), fps=animator.world.fps, body=track, fabric=fabric, scene=scene.model_dump(mode="json"),
    )  # fmt: skip
    animator.world.check(sample)
    (positions,) = _positions(animator, [animator.garments.of(mesh)], [track], [fabric], seed, push_out)
    return replace(sample, positions=positions)


def _positions(
    animator: Animator,
    garments: Sequence[UnposedGarment],
    tracks: Sequence[BodyTrack],
    fabrics: Sequence[str],
    seed: int,
    push_out: bool,
) -> list[NDArray[np.float32]]:
    told = [
        told_of(garment, track, fabric, animator.condition, animator.world.fps)
        for garment, track, fabric in zip(garments, tracks, fabrics, strict=True)
    ]
    found = []
    for garment, track, maps in zip(garments, tracks, animator.maps(told, seed), strict=True):
        positions = garment.positions(maps, track)
        if push_out:
            model = animator.garments.body
            bodies = model.vertices(track.beta, track.poses, track.translations)
            positions = push_out_frames(garment.mesh, positions, bodies, model.faces.astype(np.int64))
        found.append(positions)
    return found


def push_out_frames(
    mesh: GarmentMesh, positions: NDArray[np.float32], bodies: NDArray[np.float64], faces: NDArray[np.int64]
) -> NDArray[np.float32]:
    """Positions (T, V, 3) taken out of bodies (T, N, 3) of faces (M, 3), frame by frame."""
    push = PushOut(mesh)
    found = [
        push(frame, partial(nearest_on, vertices=body, faces=faces))
        for frame, body in zip(positions, bodies, strict=True)
    ]
    return np.stack(found).astype(np.float32)
