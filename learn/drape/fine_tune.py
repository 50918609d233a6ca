"""Fine-tuning of R_fine without simulations: random garments on random bodies, and the loss of collisions."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from muslin.learn.drape.collisions import MARGIN, Kind, collision_loss
from muslin.learn.drape.examples import Examples
from muslin.learn.drape.fabric import fabric_figures, file_stem
from muslin.learn.drape.garment import PreparedGarment
from muslin.learn.drape.objective import Batch, Item, collate_items, displacement
from muslin.learn.drape.pipeline import ANY_FABRIC, DrapePipeline
from muslin.learn.drape.predict import garment_of
from muslin.learn.training.batches import evenly
from muslin.learn.training.loop import Report, Settings, train
from muslin.learn.training.machine import training_device

MOST_VALIDATED = 24
"""Drapes of a split that are looked at after each epoch."""

_USUAL = Settings(epochs=20, learning_rate=1e-3)


@dataclass(frozen=True)
class FineTuning:
    """How: kind of loss; garments: random ones that are drawn; steps: of an epoch; batch: garments of a step;
    anchor: weight of the squared distance, in margins, from what the network said before."""

    settings: Settings = _USUAL
    kind: Kind = "distance"
    garments: int = 48
    steps: int = 25
    batch: int = 4
    anchor: float = 0.008


class CollisionObjective:
    """Mean over garments of `collision_loss`, and the anchor.

    The thesis has the loss of collisions alone. Its gradient is zero where cloth is outside, so nothing keeps
    the rest of a drape where it was; the anchor does.
    """

    def __init__(
        self,
        pipeline: DrapePipeline,
        name: str,
        garments: Sequence[PreparedGarment],
        validation: Mapping[str, Sequence[tuple[PreparedGarment, Tensor]]],
        options: FineTuning,
    ) -> None:
        """name: of the network in `pipeline.fine`; validation: {name: [(garment, shape)]} of which the share
        of vertices inside the body is logged."""
        self.pipeline, self.name, self.garments = pipeline, name, list(garments)
        self.options, self.body, self.device = options, pipeline.body, training_device()
        self.before = copy.deepcopy(pipeline.fine[name]).to(self.device).eval()
        self.fabrics = pipeline.world.fabrics if name == ANY_FABRIC else (name,)
        self.validation = {
            key: [
                self._batch([garment], [shape], [fabric])
                for garment, shape in pairs
                for fabric in self.fabrics
            ]
            for key, pairs in validation.items()
        }

    def steps(self) -> int:
        return self.options.steps

    def batches(self, epoch: int, rank: int, world: int) -> Iterator[Batch]:
        for step in range(self.options.steps):
            draw = np.random.default_rng([self.options.settings.seed, epoch, step, rank])
            count = min(self.options.batch, len(self.garments))
            chosen = [self.garments[k] for k in draw.choice(len(self.garments), count, replace=False)]
            shapes = [self._shape(draw) for _ in chosen]
            fabrics = [str(draw.choice(self.fabrics)) for _ in chosen]
            yield self._batch(chosen, shapes, fabrics)

    def _shape(self, draw: np.random.Generator) -> Tensor:
        """Of the coefficients that the networks see, as widely as they were trained."""
        network = self.before
        # The root mean square of a uniform distribution is its half-width over the root of three.
        half = np.sqrt(3.0) * float(network.beta_scale)
        return torch.tensor(draw.uniform(-half, half, network.config.betas), dtype=torch.float32)

    @torch.no_grad()
    def _batch(
        self, garments: Sequence[PreparedGarment], shapes: Sequence[Tensor], fabrics: Sequence[str]
    ) -> Batch:
        """From smooth drapes to what the network said of them before."""
        starts = self.pipeline.smooth_drapes(garments, shapes)
        figures = [*fabric_figures(fabrics)] if self.name == ANY_FABRIC else [None] * len(garments)
        items = [
            Item(garment, shape, start, start, fabric)
            for garment, shape, start, fabric in zip(garments, shapes, starts, figures, strict=True)
        ]
        batch = collate_items(items, self.device)
        return replace(batch, goal=batch.start + displacement(self.before, batch))

    def loss(self, model: nn.Module, batch: Batch) -> Tensor:
        points = batch.start + displacement(model, batch)
        counts = torch.bincount(batch.graphs.graph[0]).tolist()
        inside = [
            collision_loss(part, shape, self.body, self.options.kind)
            for part, shape in zip(points.split(counts), batch.beta, strict=True)
        ]
        moved = ((points - batch.goal) / MARGIN).square().sum(1).mean()
        return torch.stack(inside).mean() + self.options.anchor * moved

    def validate(self, model: nn.Module) -> dict[str, float]:
        return {
            f"{name}_inside": float(np.mean([self._inside(model, batch) for batch in batches]))
            for name, batches in self.validation.items()
        }

    def _inside(self, model: nn.Module, batch: Batch) -> float:
        """Share of the vertices of the one garment of a batch that are inside the body."""
        points = (batch.start + displacement(model, batch)).cpu().numpy()
        distances, *_ = self.body.nearest(points, batch.beta[0].tolist())
        return float((distances < 0.0).mean())

    def identity(self) -> dict[str, Any]:
        options = self.options
        return {
            "kind": options.kind,
            "garments": len(self.garments),
            "vertices": sum(len(garment.mean) for garment in self.garments),
            "steps": options.steps,
            "batch": options.batch,
            "anchor": options.anchor,
        }


def random_garments(
    pipeline: DrapePipeline,
    examples: Examples,
    count: int,
    seed: int,
    progress: Callable[[int, int], None] | None = None,
) -> list[PreparedGarment]:
    """Garments of parameters between those of the examples, of triangles as large as theirs, prepared."""
    draw = np.random.default_rng([seed, count])
    areas = [float(mesh.face_areas.mean()) for mesh in examples.garments]
    made = []
    for number in range(count):
        values = {
            name: draw.uniform(
                min(mesh.parameters[name] for mesh in examples.garments),
                max(mesh.parameters[name] for mesh in examples.garments),
            )
            for name in examples.parameters
        }
        area = draw.uniform(min(areas), max(areas))
        made.append(pipeline.prepare(garment_of(examples.world.design, values, area, number)))
        if progress is not None:
            progress(number + 1, count)
    return made


def fine_tune(
    pipeline: DrapePipeline,
    examples: Examples,
    out: Path,
    options: FineTuning,
    validation: Mapping[str, Examples] | None = None,
    report: Callable[[str], Report] | None = None,
) -> DrapePipeline:
    """Fine-tune every R_fine of a pipeline, in place, and save it into `out`.

    examples     of the training set, between whose designs the random ones lie
    validation   {name: examples} on whose garments and shapes the share of vertices inside is logged
    """
    garments = random_garments(pipeline, examples, options.garments, options.settings.seed)
    pairs = {
        name: _some_pairs(pipeline, own) for name, own in {"train": examples, **(validation or {})}.items()
    }
    for name, network in pipeline.fine.items():
        objective = CollisionObjective(pipeline, name, garments, pairs, options)
        told = report(name) if report else None
        train(
            network, objective, options.settings, out / "train" / f"collisions-{file_stem(name)}", report=told
        )
        pipeline.fine[name] = network.cpu().eval()
    pipeline.save(out)
    return pipeline


def _some_pairs(pipeline: DrapePipeline, examples: Examples) -> list[tuple[PreparedGarment, Tensor]]:
    """Garment and shape of some of the examples."""
    some = [examples.examples[k] for k in evenly(len(examples.examples), MOST_VALIDATED)]
    garments = {place: pipeline.prepare(examples.garments[place]) for place in {e.garment for e in some}}
    return [(garments[example.garment], example.beta) for example in some]
