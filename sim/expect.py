"""What a scene expects of its sample, held against what the sample is."""

from __future__ import annotations

import numpy as np

from muslin.sim.dataset.sample import Sample
from muslin.sim.scene import ExpectTable, Scene


def check_expectations(scene: Scene, sample: Sample) -> list[str]:
    """One sentence for every entry of `scene.expect` that `sample` violates: key, measured, allowed.

    Intersections must be zero whatever the scene says. A figure that the certificate does not hold violates
    the entry that asks for it, except the smallest distance: without one, nothing came near anything.
    """
    found = sample.certificate
    wanted = scene.expect
    violations = [
        f"{key}: measured {'nothing' if count is None else count}, allowed is 0"
        for key, count in (
            ("cloth_cloth_intersections", found.cloth_cloth_intersections),
            ("cloth_body_intersections", found.cloth_body_intersections),
        )
        if count != 0
    ]
    stretch = None if found.largest_strain is None else 1.0 + found.largest_strain
    violations += _at_most("largest_stretch", stretch, wanted.largest_stretch)
    violations += _at_most("residual", found.force_residual, wanted.residual)
    distance, least = found.min_distance_m, wanted.smallest_distance
    if least is not None and distance is not None and not distance >= least:
        violations.append(
            f"expect.smallest_distance: measured {distance:.4g} m, allowed is at least {least:.4g} m"
        )
    violations += _points(wanted, sample)
    if wanted.frames is not None and sample.num_frames != wanted.frames:
        violations.append(f"expect.frames: measured {sample.num_frames}, allowed is {wanted.frames}")
    at_rest = found.extra.get("at_rest")
    if wanted.at_rest is not None and at_rest != wanted.at_rest:
        measured = "nothing" if at_rest is None else str(at_rest).lower()
        violations.append(f"expect.at_rest: measured {measured}, allowed is {str(wanted.at_rest).lower()}")
    return violations


def _at_most(key: str, measured: float | None, allowed: float | None) -> list[str]:
    if allowed is None or (measured is not None and measured <= allowed):
        return []
    shown = "nothing" if measured is None else f"{measured:.4g}"
    return [f"expect.{key}: measured {shown}, allowed is at most {allowed:.4g}"]


def _points(wanted: ExpectTable, sample: Sample) -> list[str]:
    heights = np.concatenate([sample.frame_positions(frame)[:, 1] for frame in range(sample.num_frames)])
    violations = []
    for key, measured, allowed in (
        ("lowest_point", float(heights.min()), wanted.lowest_point),
        ("highest_point", float(heights.max()), wanted.highest_point),
    ):
        if allowed is not None and not allowed[0] <= measured <= allowed[1]:
            span = f"from {allowed[0]:.4g} to {allowed[1]:.4g} m"
            violations.append(f"expect.{key}: measured {measured:.4g} m, allowed is {span}")
    return violations
