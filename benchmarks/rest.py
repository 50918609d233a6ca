"""How near to rest the stop rule ends a drape, and how far it depends on how the cloth came there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from muslin.sim.dataset.sample import Sample
from muslin.sim.run import compile_kernels, simulate, simulate_chain
from muslin.sim.scene import BodyTable, GarmentTable, Scene

TIGHTER = 10.0
"""The reference moves by this much less before it counts as at rest, and may take as many times the steps."""

DETOUR = 1.0
"""beta_1 of the body on which the cloth of the other way has come to rest before."""


@dataclass(frozen=True)
class RestFigures:
    """Vertex distances in mm of the drape at the stop rule: mean, 99th percentile, largest.

    `rule`: to the drape solved `TIGHTER`; `detour`: to the drape that came by another body. Steps and
    residuals (share of the weight) of the first two, and whether all three came to rest.
    """

    preset: str
    vertices: int
    rule: tuple[float, float, float]
    detour: tuple[float, float, float]
    steps: tuple[int, int]
    residuals: tuple[float, float]
    at_rest: bool


def rest_figures(preset: str, edge_length: float) -> RestFigures:
    """Three drapes of one garment on the mean body, made by the same dressing up to where they differ."""
    compile_kernels("cpu")
    scene = Scene(
        name=preset,
        garment=GarmentTable(preset=preset, edge_length=edge_length),
        body=BodyTable(beta=[0.0]),
    )
    solver = scene.solver
    tighter = solver.model_copy(
        update={
            "settle_tolerance": solver.settle_tolerance / TIGHTER,
            "settle_steps": round(TIGHTER * solver.settle_steps),
        }
    )
    away = scene.model_copy(update={"body": BodyTable(beta=[DETOUR])})
    ended = simulate(scene)
    tight = simulate(scene.model_copy(update={"solver": tighter}))
    other = list(simulate_chain([away, scene]))[1]
    return RestFigures(
        preset=preset,
        vertices=ended.positions.shape[1],
        rule=_distances(ended, tight),
        detour=_distances(ended, other),
        steps=(int(ended.certificate.extra["settle_steps"]), int(tight.certificate.extra["settle_steps"])),
        residuals=(_residual(ended), _residual(tight)),
        at_rest=all(bool(s.certificate.extra["at_rest"]) for s in (ended, tight, other)),
    )


def _distances(a: Sample, b: Sample) -> tuple[float, float, float]:
    d: NDArray[np.float64] = 1e3 * np.linalg.norm(a.positions[0] - b.positions[0], axis=1)
    return float(d.mean()), float(np.percentile(d, 99.0)), float(d.max())


def _residual(sample: Sample) -> float:
    residual = sample.certificate.force_residual
    if residual is None:
        raise ValueError(f"the certificate of drape {sample.id!r} states no residual")
    return residual
