"""The certificate of a sample, measured on the positions as they are stored."""

from __future__ import annotations

import time
from dataclasses import replace
from importlib.metadata import version

import numpy as np

from muslin.sim.dataset.certificate import Certificate
from muslin.sim.dataset.intersections import count_intersections
from muslin.sim.dataset.sample import Sample
from muslin.sim.elastic import principal_stretches
from muslin.sim.relax import RestReport
from muslin.sim.remesh.in_loop import Remesher
from muslin.sim.rounding import STEP_M, round_sample
from muslin.sim.scene import Scene


def certify(sample: Sample, base: Certificate) -> Sample:
    """`sample` with `base` completed by intersections (ipctk), masked faces and strain of every frame."""
    cloth_cloth = cloth_body = 0
    stretch = 0.0
    for frame in range(sample.num_frames):
        garment, positions = sample.frame_garment(frame), sample.frame_positions(frame).astype(np.float64)
        live = np.ones(len(sample.body_faces), bool)
        live[sample.masked(frame)] = False
        counts = count_intersections(
            positions, garment.faces, sample.body_vertices(frame), sample.body_faces[live]
        )
        cloth_cloth += counts.cloth_cloth
        cloth_body += counts.cloth_body
        stretch = max(stretch, float(principal_stretches(garment, positions)[:, 0].max()))
    masked = max((len(faces) for faces in sample.masked_faces), default=0)
    return replace(
        sample,
        certificate=replace(
            base,
            cloth_cloth_intersections=cloth_cloth,
            cloth_body_intersections=cloth_body,
            masked_body_faces_max=masked,
            largest_strain=stretch - 1.0,
        ),
    )


def certify_rounded(sample: Sample, base: Certificate) -> Sample:
    """`sample` on the grid of `muslin.sim.rounding`, certified there; as it is, if it crosses itself or the
    collider on the grid. `position_step_m` in the certificate's `extra` is the step, 0 without rounding."""
    for made, step in ((round_sample(sample), STEP_M), (sample, 0.0)):
        noted = replace(base, extra={**base.extra, "position_step_m": step})
        found = certify(made, noted)
        if not (found.certificate.cloth_cloth_intersections or found.certificate.cloth_body_intersections):
            break
    return found


def solved(
    scene: Scene,
    distance: float,
    rest: RestReport | None,
    started: float,
    frames: int,
    remesher: Remesher | None = None,
) -> Certificate:
    """What the solver knows of a sample: `distance` m at the closest, how it came to `rest`, versions, what
    the `remesher` did, and the seconds since `started`, a time of `time.perf_counter`."""
    seconds = time.perf_counter() - started
    extra: dict[str, float | int | bool] = {"seconds_per_frame": seconds / frames}
    if rest is not None:
        extra |= {"settle_steps": rest.steps, "last_move_m": rest.moved, "at_rest": rest.at_rest}
    if remesher is not None:
        done = remesher.changes
        extra |= {"splits": done.splits, "flips": done.flips, "collapses": done.collapses}
        extra |= {"remesh_seconds": remesher.seconds}
    return Certificate(
        min_distance_m=distance if np.isfinite(distance) else None,
        force_residual=None if rest is None else rest.residual,
        seed=scene.seed,
        seconds=seconds,
        versions={name: version(name) for name in ("muslin", "warp-lang", "numpy", "ipctk")},
        extra=extra,
    )
