"""Predicted drapes in the form of simulated ones."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.garments.template import template
from muslin.learn.drape.fully_connected import load_dense
from muslin.learn.drape.pipeline import GRAPHS, MEAN, load_pipeline
from muslin.learn.drape.world import Draper
from muslin.sim.dataset.certificate import Certificate
from muslin.sim.dataset.reader import Dataset, write_dataset
from muslin.sim.dataset.root import Root
from muslin.sim.dataset.sample import BodyTrack, Sample
from muslin.sim.remesh.topology import remesh

SHIPPED = Path(__file__).parent / "assets" / "tee"
"""A pipeline that comes with the package; its model card is beside it."""
RESOLUTION = 4000
"""Template from which triangulations are drawn."""


def load_draper(folder: Path) -> Draper[Any]:
    """What `muslin train` wrote into a folder: the pipeline, or fully-connected networks.

    Raises InputError if it holds neither, or is damaged.
    """
    if (folder / MEAN).exists():
        return load_pipeline(folder, None if folder == SHIPPED else folder / GRAPHS)
    return load_dense(folder)


def predict_dataset(
    draper: Draper[Any],
    truth: Dataset,
    out: str | Path | Root,
    *,
    batch: int = 8,
    progress: Callable[[float, int, str], None] | None = None,
) -> Dataset:
    """A prediction for every sample of `truth`, under its id and on its triangulation, as a dataset.

    Of a sample its garment, shape and fabric are looked at, not its positions. Raises InputError for what
    was not learned: another family, body or pose, a fabric that is not known.
    """
    made: list[Sample] = []
    prepared: dict[tuple[str, str], Any] = {}
    for first in range(0, len(truth), batch):
        rows = truth.rows[first : first + batch]
        samples = [truth[row["id"]] for row in rows]
        for row, sample in zip(rows, samples, strict=True):
            draper.world.check(sample)
            key = row["design"], row["topology"]
            if key not in prepared:
                prepared[key] = draper.prepare(sample.garment)
        begun = time.perf_counter()
        drapes = draper.drapes(
            [prepared[row["design"], row["topology"]] for row in rows],
            [sample.body.beta for sample in samples if sample.body is not None],
            [sample.fabric for sample in samples],
        )
        seconds = (time.perf_counter() - begun) / len(rows)
        for sample, drape in zip(samples, drapes, strict=True):
            certificate = Certificate(seconds=seconds, extra={"prediction_of": sample.id})
            assert sample.body is not None
            positions = (drape.numpy() + sample.body.translations).astype(np.float32)[None]
            made.append(replace(sample, positions=positions, certificate=certificate))
        if progress is not None:
            progress(first + len(rows), len(truth), rows[-1]["id"])
    return write_dataset(out, made, config={"name": "prediction", "of": str(truth.root)})


def predict_one(
    draper: Draper[Any], mesh: GarmentMesh, beta: ArrayLike, fabric: str, sample_id: str = "prediction"
) -> Sample:
    """The drape of one garment, of any triangulation, on the body of one shape, at the origin."""
    (drape,) = draper.drapes([draper.prepare(mesh)], [beta], [fabric])
    world = draper.world
    shape = np.zeros(world.load_body().num_betas)
    given = np.asarray(beta, dtype=np.float64)
    if given.ndim != 1 or len(given) > len(shape) or not np.isfinite(given).all():
        raise InputError(f"beta = {given.tolist()}: must be up to {len(shape)} finite numbers")
    shape[: len(given)] = given
    track = BodyTrack(world.body, world.digest, shape, np.array([world.theta]), np.zeros((1, 3)))
    return Sample(sample_id, "drape", mesh, drape.numpy()[None], Certificate(), body=track, fabric=fabric)


def garment_of(
    design: str, parameters: Mapping[str, float], target_area: float | None = None, seed: int = 0
) -> GarmentMesh:
    """A triangulation of a member of a family: the template of 4,000 vertices, or, of triangles of a mean
    area in square metres, the one that the seed draws."""
    source = template(design, parameters, RESOLUTION)
    if target_area is None:
        return source
    return remesh(source, np.zeros((source.num_vertices, 3)), target_area, seed=seed).mesh
