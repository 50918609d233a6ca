"""Writes a baked body: SMPL's keys, bases as 16-bit integers with a scale."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from muslin.sim.body.joints import NUM_JOINTS, PARENTS

Floats = NDArray[np.float64]

# Metres for one step of the stored integers.
SHAPE_STEP = 5e-6
POSE_STEP = 5e-5
WEIGHT_STEPS = 1 << 14


def quantised(array: Floats, step: float) -> NDArray[np.int16]:
    """The nearest multiples of `step`; an array that does not fit 16 bits is an error of the bake."""
    values = np.rint(array / step)
    if np.abs(values).max() > np.iinfo(np.int16).max:
        raise OverflowError(f"{np.abs(array).max()} is more than 16 bits of steps of {step}")
    return values.astype(np.int16)


def quantised_weights(weights: Floats) -> NDArray[np.int16]:
    """Weights in steps of 2^-14 whose rows sum to exactly one: the heaviest joint takes the rounding."""
    steps = np.rint(weights * WEIGHT_STEPS).astype(np.int64)
    heaviest = np.argmax(steps, axis=1)
    steps[np.arange(len(steps)), heaviest] += WEIGHT_STEPS - steps.sum(axis=1)
    return steps.astype(np.int16)


def write_asset(
    path: Path,
    *,
    v_template: Floats,
    shapedirs: Floats,
    posedirs: Floats,
    joint_template: Floats,
    joint_shapedirs: Floats,
    joint_regressor: Floats,
    weights: Floats,
    faces: NDArray[np.int32],
    source: str,
) -> None:
    """Writes the .npz. An integer array `a` with a scalar `a_scale` beside it means a * a_scale."""
    parents = np.array(PARENTS, dtype=np.int32)
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(
        path,
        v_template=v_template.astype(np.float32),
        shapedirs=quantised(shapedirs, SHAPE_STEP),
        shapedirs_scale=np.float64(SHAPE_STEP),
        posedirs=quantised(posedirs, POSE_STEP),
        posedirs_scale=np.float64(POSE_STEP),
        weights=quantised_weights(weights),
        weights_scale=np.float64(1.0 / WEIGHT_STEPS),
        J_regressor=joint_regressor.astype(np.float32),
        joint_template=joint_template.astype(np.float32),
        joint_shapedirs=joint_shapedirs.astype(np.float32),
        kintree_table=np.stack([parents, np.arange(NUM_JOINTS, dtype=np.int32)]),
        f=faces.astype(np.int32),
        source=np.array(source),
    )
