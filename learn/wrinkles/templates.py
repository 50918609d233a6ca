"""The template of each design: what its garment is on the average, unposed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from numpy.typing import NDArray

from muslin.garments.correspondence import correspondence
from muslin.garments.mesh import GarmentMesh
from muslin.garments.template import EDGE_LENGTHS, template, template_of
from muslin.learn.drape.fit_mean import fit_mean
from muslin.learn.drape.mean import MeanDrape
from muslin.learn.wrinkles.condition import varied_parameters
from muslin.learn.wrinkles.skin import GarmentSkin, garment_skin
from muslin.learn.wrinkles.world import SequenceWorld
from muslin.sim.body.model import BodyModel
from muslin.sim.body.skinning import bind
from muslin.sim.dataset.sample import Sample

ROUNDS = 4
"""Of template and skin, each from the other; in the last the template moves by less than a millimetre."""


def templates_of(samples: Sequence[Sample], world: SequenceWorld, seed: int = 0) -> MeanDrape:
    """G_design of sequences."""
    designs: dict[tuple[float, ...], list[Sample]] = {}
    for sample in samples:
        world.check(sample)
        designs.setdefault(tuple(sample.garment.parameters.values()), []).append(sample)
    return fit_templates([*designs.values()], varied_parameters(samples), world.load_body(), seed)


def fit_templates(
    designs: Sequence[Sequence[Sample]], names: Sequence[str], body: BodyModel, seed: int = 0
) -> MeanDrape:
    """G_design: the network of R_mean, from parameters to positions in T-pose at the vertices of a template.

    designs: sequences of each design; names: design parameters that vary. The uv of a vertex need not be
    learned, it follows from the pattern (`muslin.garments.uv_layout`). Raises InputError if no parameter
    varies.
    """
    first = designs[0][0].garment
    resolution = max(_resolution(sample.garment) for samples in designs for sample in samples)
    parameters, found = [], []
    for samples in designs:
        own = template(first.name, samples[0].garment.parameters, resolution)
        found.append(torch.from_numpy(mean_unposed([on_mesh(sample, own) for sample in samples], body)))
        parameters.append([own.parameters[name] for name in names])
    return fit_mean(first.name, names, torch.tensor(parameters), torch.stack(found).float(), seed, resolution)


def on_mesh(sample: Sample, mesh: GarmentMesh) -> Sample:
    """A sequence at the vertices of another triangulation of its garment."""
    if np.array_equal(sample.garment.faces, mesh.faces):
        return sample
    place = correspondence(sample.garment, mesh)
    positions = np.stack([place.carry(frame) for frame in sample.positions])
    return replace(sample, garment=mesh, positions=positions.astype(np.float32))


def mean_unposed(samples: Sequence[Sample], body: BodyModel) -> NDArray[np.float64]:
    """(V, 3) mean over all frames of sequences of one mesh, unposed to the mean body in T-pose, metres.

    They are unposed with the skin of the mean itself, found in ROUNDS; the first takes the nearest points of
    the body in the first frame of each.
    """
    mesh = samples[0].garment
    mean: NDArray[np.float64] = np.mean([_first_unposed(sample, body) for sample in samples], axis=0)
    for _ in range(ROUNDS):
        skin = garment_skin(mesh, mean, body)
        mean = np.concatenate([_unposed(sample, skin) for sample in samples]).mean(axis=0)
    return mean


def _unposed(sample: Sample, skin: GarmentSkin) -> NDArray[np.float64]:
    track = sample.body
    assert track is not None
    return skin.unposed(sample.positions, track.beta, track.poses, track.translations)


def _first_unposed(sample: Sample, body: BodyModel) -> NDArray[np.float64]:
    track = sample.body
    assert track is not None
    pose = track.beta, track.poses[:1], track.translations[:1]
    near = bind(sample.positions[0], body, track.beta, track.poses[0], track.translations[0])
    own = near.weights, near.interpolate(body.shapedirs), near.interpolate(body.posedirs)
    return GarmentSkin(body, *own).unposed(sample.positions[:1], *pose)[0]


def _resolution(mesh: GarmentMesh) -> int:
    """That of the template a mesh is, or the nearest by its number of vertices."""
    near = min(EDGE_LENGTHS, key=lambda resolution: abs(resolution - mesh.num_vertices))
    return template_of(mesh) or near
