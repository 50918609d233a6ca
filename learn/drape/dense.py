"""Drapes on the one dense mesh of a family: what methods that know one topology learn from and say."""

from __future__ import annotations

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from muslin.garments.correspondence import Correspondence, correspondence
from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.garments.template import template, template_of
from muslin.learn.drape.examples import Examples
from muslin.learn.drape.world import World


@dataclass(frozen=True, eq=False)
class DenseDrapes:
    """N drapes on the template of V vertices.

    world, resolution      of the template
    names, parameters      (P) names of the parameters that vary, (N, P) their values, metres
    betas                  (N, B) standard deviations
    fabrics                (N,) names
    positions              (N, V, 3) metres
    """

    world: World
    resolution: int
    names: tuple[str, ...]
    parameters: Tensor
    betas: Tensor
    fabrics: tuple[str, ...]
    positions: Tensor

    def of(self, chosen: Tensor) -> DenseDrapes:
        """Those at places (or where a mask is set)."""
        places = chosen.nonzero()[:, 0] if chosen.dtype == torch.bool else chosen
        return replace(
            self,
            parameters=self.parameters[places],
            betas=self.betas[places],
            fabrics=tuple(self.fabrics[int(k)] for k in places),
            positions=self.positions[places],
        )

    def place(self, mesh: GarmentMesh) -> Correspondence:
        """Where the vertices of a triangulation lie on the dense mesh of its design.

        Raises InputError for a garment of another family.
        """
        return place_on_template(mesh, self.world.design, self.resolution)


def place_on_template(mesh: GarmentMesh, design: str, resolution: int) -> Correspondence:
    """Where the vertices of a triangulation lie on the template of its member of the family.

    Raises InputError for a garment of another one.
    """
    if mesh.name != design:
        raise InputError(f"a garment of design {mesh.name!r}; what was learned is of {design!r}")
    return correspondence(template(design, mesh.parameters, resolution), mesh)


def dense_drapes(examples: Examples) -> DenseDrapes:
    """The drapes of all examples whose mesh is the template that was simulated.

    Raises InputError if none is: the dataset needs the topology "source", of a template.
    """
    resolutions = [template_of(mesh) for mesh in examples.garments]
    known = [resolution for resolution in resolutions if resolution is not None]
    if not known:
        raise InputError('no drape is on a template; these methods need the topology "source" of a template')
    finest = max(known)
    rows = [
        (examples.garments[example.garment], example.beta[: examples.betas], fabric, drape)
        for example in examples.examples
        if resolutions[example.garment] == finest
        for fabric, drape in example.drapes.items()
    ]
    parameters = [[mesh.parameters[name] for name in examples.parameters] for mesh, *_ in rows]
    return DenseDrapes(
        world=examples.world,
        resolution=finest,
        names=examples.parameters,
        parameters=torch.tensor(parameters, dtype=torch.float32),
        betas=torch.stack([beta for _, beta, _, _ in rows]),
        fabrics=tuple(fabric for _, _, fabric, _ in rows),
        positions=torch.stack([drape for *_, drape in rows]),
    )
