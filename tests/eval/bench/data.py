"""A small dataset with known splits, and predictions whose errors are known in closed form."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from muslin.sim.body import load_body
from muslin.sim.dataset.certificate import Certificate
from muslin.sim.dataset.reader import open_dataset, write_dataset
from muslin.sim.dataset.sample import BodyTrack, Sample
from tests.eval.conftest import SIDE, square

FPS = 30.0
FRAMES = 4
TOPOLOGIES = {"t0": 4, "t1": 5, "t2": 6}
BETAS = {"s0": -2.0, "s1": 2.0, "s2": -1.0, "s3": 0.5, "s4": 1.5}
ABOVE = 0.9  # metres: the sheet hangs above the body's head


def sheet(
    design: str, shape: str, topology: str, sequence: str = "", split: str = "train", body: bool = True
) -> Sample:
    """A level sheet above a body; in a sequence it rises 1 cm a frame."""
    garment = replace(square(TOPOLOGIES[topology]), parameters={"side": SIDE})
    grid = garment.panel_vertices - SIDE / 2
    frames = FRAMES if sequence else 1
    heights = ABOVE + 0.01 * np.arange(frames)
    positions = np.stack([np.stack([grid[:, 0], np.full(len(grid), y), -grid[:, 1]], 1) for y in heights])
    labels = {"design": design, "shape": shape, "topology": topology, "sequence": sequence, "split": split}
    track = None
    if body:
        beta = np.array([0.0, BETAS[shape]])
        still = np.zeros((frames, 24, 3)), np.zeros((frames, 3))
        track = BodyTrack("female", load_body("female").digest, beta, *still)
    return Sample(
        id="-".join(filter(None, (design, shape, topology, sequence))),
        kind="sequence" if sequence else "drape",
        garment=garment,
        positions=positions.astype(np.float32),
        certificate=Certificate(cloth_cloth_intersections=0, cloth_body_intersections=0),
        fps=FPS if sequence else None,
        body=track,
        fabric="gray-interlock",
        labels={key: value for key, value in labels.items() if value},
    )


def truth_samples() -> Iterator[Sample]:
    """Trained on: designs a and b, shapes s0 and s1, topologies t0 and t1, sequence walk."""
    yield sheet("a", "s0", "t0")
    yield sheet("a", "s1", "t1")
    yield sheet("b", "s0", "t0")
    yield sheet("a", "s0", "t0", "walk")
    for design, shapes in (("a", ("s2", "s3", "s4")), ("b", ("s2", "s3"))):
        for shape in shapes:
            yield sheet(design, shape, "t0", split="test")
            yield sheet(design, shape, "t2", split="topologies")
    for design, shapes in (("c", ("s2", "s3", "s4")), ("d", ("s2", "s3", "s4"))):
        for shape in shapes:
            yield sheet(design, shape, "t0", split="designs")
    yield sheet("a", "s0", "t0", "jump", split="sequences")
    yield sheet("c", "s0", "t0", "walk", split="designs")
    yield sheet("c", "s0", "t0", "jump", split="designs")
    yield sheet("d", "s0", "t0", "jump", split="designs")


def write_truth(folder: Path) -> Path:
    write_dataset(folder, truth_samples())
    return folder


Rise = Callable[[Sample, int], float]


def risen(sample: Sample, rise: Rise) -> np.ndarray:
    """The sheet `rise(sample, frame)` metres higher; (T, V, 3)."""
    moved = sample.positions.astype(np.float64)
    for t in range(sample.num_frames):
        moved[t, :, 1] += rise(sample, t)
    return moved


def predict(truth: Path, folder: Path, rise: Rise, leave_out: tuple[str, ...] = ()) -> Path:
    """A method that puts the sheet of each sample outside training too high, as a dataset."""
    samples = [open_dataset(truth)[i] for i in scored_ids(truth) if i not in leave_out]
    write_dataset(folder, [replace(s, positions=risen(s, rise).astype(np.float32)) for s in samples])
    return folder


def predict_files(truth: Path, folder: Path, rise: Rise, leave_out: tuple[str, ...] = ()) -> Path:
    """The same as a folder with one file of arrays for each sample."""
    folder.mkdir()
    for sample in (open_dataset(truth)[i] for i in scored_ids(truth) if i not in leave_out):
        np.savez(folder / f"{sample.id}.npz", vertices=risen(sample, rise), faces=sample.garment.faces)
    return folder


def scored_ids(truth: Path) -> list[str]:
    """Samples outside training that one of the shipped protocols scores."""
    rows = open_dataset(truth).rows
    return [
        row["id"]
        for row in rows
        if row["split"] != "train" and (row["kind"] == "drape" or row["id"].endswith("s0-t0-jump"))
    ]
