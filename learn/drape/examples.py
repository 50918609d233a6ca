"""What the networks learn from: the drapes of a dataset."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from muslin.garments.correspondence import correspondence
from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.garments.template import template, template_of
from muslin.learn.drape.mean import RESOLUTION
from muslin.learn.drape.world import World, in_body_frame
from muslin.sim.dataset.reader import Dataset
from muslin.sim.dataset.sample import Sample


@dataclass(frozen=True, eq=False)
class Example:
    """One triangulation of a garment on one body.

    garment    place in `Examples.garments`
    beta       (n,) standard deviations
    drapes     {fabric: (V, 3)} as simulated, `in_body_frame`, metres
    ids        {fabric: sample id}
    """

    garment: int
    beta: Tensor
    drapes: dict[str, Tensor]
    ids: dict[str, str]

    @property
    def average(self) -> Tensor:
        """(V, 3) over the fabrics."""
        return torch.stack([*self.drapes.values()]).mean(0)


@dataclass(frozen=True, eq=False)
class Examples:
    """All examples of a dataset: their distinct garments, and what they have in common.

    parameters: names of those that vary.
    """

    examples: tuple[Example, ...]
    garments: tuple[GarmentMesh, ...]
    world: World
    parameters: tuple[str, ...]

    @property
    def betas(self) -> int:
        """Number of shape coefficients that are used: up to the last that is not zero everywhere."""
        used = torch.stack([example.beta for example in self.examples]).abs().amax(0).nonzero()
        return int(used.max()) + 1 if len(used) else 1


def read_examples(dataset: Dataset) -> Examples:
    """The drapes of a dataset (or a part of it), grouped by garment and shape, each with all fabrics.

    Raises InputError for sequences, for cloth on no parametric body or on different ones, and where a fabric
    is missing for some drape.
    """
    fabrics = tuple(dict.fromkeys(row["fabric"] for row in dataset.rows))
    garments: dict[tuple[str, str], int] = {}
    meshes: list[GarmentMesh] = []
    world: World | None = None
    examples = []
    for (design, topology, shape), rows in _groups(dataset.rows).items():
        samples = {row["fabric"]: dataset[row["id"]] for row in rows}
        if missing := [fabric for fabric in fabrics if fabric not in samples]:
            raise InputError(
                f"{dataset.root}: {design} {topology} {shape} has no drape of {missing[0]}, as others have; "
                "finish it with `muslin generate`, or select one fabric"
            )
        for sample in samples.values():
            world = world or _world(sample, fabrics)
            world.check(sample)
        place = garments.setdefault((design, topology), len(garments))
        own = samples[fabrics[0]]
        if place == len(meshes):
            meshes.append(own.garment)
        drapes = {fabric: torch.from_numpy(in_body_frame(s)) for fabric, s in samples.items()}
        assert own.body is not None
        beta = torch.tensor(own.body.beta, dtype=torch.float32)
        ids = {fabric: sample.id for fabric, sample in samples.items()}
        examples.append(Example(place, beta, drapes, ids))
    if world is None:
        raise InputError(f"{dataset.root}: no drape is left to learn from")
    varied = [n for n, value in meshes[0].parameters.items() if any(m.parameters[n] != value for m in meshes)]
    return Examples(tuple(examples), tuple(meshes), world, tuple(varied))


def _world(sample: Sample, fabrics: tuple[str, ...]) -> World:
    if sample.body is None:
        raise InputError(f"sample {sample.id} is on no parametric body, and nothing can be learned of shapes")
    body = sample.body
    return World(sample.frame_garment(0).name, body.model, body.digest, body.poses[0].tolist(), fabrics)


def _groups(rows: Iterable[Mapping[str, Any]]) -> dict[tuple[str, str, str], list[Mapping[str, Any]]]:
    groups: dict[tuple[str, str, str], list[Mapping[str, Any]]] = {}
    for row in rows:
        groups.setdefault((row["design"], row["topology"], row["shape"]), []).append(row)
    return groups


def mean_drapes(examples: Examples, resolution: int = RESOLUTION) -> tuple[Tensor, Tensor]:
    """What R_mean learns from: parameters (N, P) of each design, and its drape (N, V, 3) at the vertices of
    the template, metres.

    That is the average, over fabrics and over the shapes that are nearest to the mean one, of drapes on the
    finest template of the design, or, without one, its finest triangulation.
    """
    best: dict[tuple[float, ...], tuple[tuple[int, int], int]] = {}
    for place, mesh in enumerate(examples.garments):
        found = (template_of(mesh) or 0, mesh.num_vertices), place
        key = tuple(mesh.parameters.values())
        best[key] = max(best.get(key, found), found)
    parameters, drapes = [], []
    for _, place in best.values():
        mesh = examples.garments[place]
        own = [example for example in examples.examples if example.garment == place]
        off = [float(example.beta.norm()) for example in own]
        nearest = [e for e, distance in zip(own, off, strict=True) if distance <= min(off) + 1e-6]
        average = torch.stack([example.average for example in nearest]).mean(0)
        coarse = template(mesh.name, mesh.parameters, resolution)
        drapes.append(torch.from_numpy(correspondence(mesh, coarse).carry(average.numpy())))
        parameters.append(torch.tensor([mesh.parameters[name] for name in examples.parameters]))
    return torch.stack(parameters).float(), torch.stack(drapes).float()
