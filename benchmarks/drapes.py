"""Static drapes: from the sewn start, and from a neighbour whose body shape is a little different."""

from __future__ import annotations

import time
from dataclasses import dataclass

from benchmarks.garment import SCENE
from muslin.sim.dataset.certificate import Certificate
from muslin.sim.run import compile_kernels, simulate_chain
from muslin.sim.scene import Scene, load_scene


@dataclass(frozen=True)
class DrapeCost:
    """CPU seconds of one drape, its certificate's count of intersections, and its state of rest."""

    beta: float
    cpu_seconds: float
    at_rest: bool
    residual: float | None
    intersections: int
    largest_strain: float | None
    steps: int


def drape_costs(neighbours: int, step: float, edge_length: float | None) -> list[DrapeCost]:
    """A drape from the sewn start at beta 0, then `neighbours` more, `step` further in beta_1 each.

    Everything that makes a certified sample is counted: dressing in the first, changing shape in the
    others, coming to rest, counting intersections.
    """
    compile_kernels("cpu")
    overrides = [] if edge_length is None else [f"garment.edge_length={edge_length}"]
    scene = load_scene(SCENE, overrides)
    chain = simulate_chain([_drape(scene, k, k * step) for k in range(neighbours + 1)])
    costs = []
    for k in range(neighbours + 1):
        start = time.process_time()
        certificate = next(chain).certificate
        seconds = time.process_time() - start
        costs.append(
            DrapeCost(
                beta=k * step,
                cpu_seconds=seconds,
                at_rest=bool(certificate.extra["at_rest"]),
                residual=certificate.force_residual,
                intersections=_crossings(certificate),
                largest_strain=certificate.largest_strain,
                steps=int(certificate.extra["settle_steps"]),
            )
        )
    return costs


def _crossings(certificate: Certificate) -> int:
    counts = (certificate.cloth_cloth_intersections, certificate.cloth_body_intersections)
    if None in counts:
        raise ValueError("the certificate does not say how many intersections the drape has")
    return sum(count for count in counts if count is not None)


def _drape(scene: Scene, number: int, beta: float) -> Scene:
    assert scene.body is not None
    body = scene.body.model_copy(update={"beta": [beta]})
    return scene.model_copy(update={"name": f"drape_{number}", "motion": None, "body": body})
