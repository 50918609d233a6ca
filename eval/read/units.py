"""Whether numbers can be metres: a garment is neither as big as a house nor as small as a coin."""

from __future__ import annotations

import numpy as np

from muslin.eval.read.track import Track
from muslin.garments.errors import InputError

SMALLEST, LARGEST = 0.05, 20.0  # metres, diagonal of the bounding box
USUAL = 1.2  # metres, about that of a shirt or of trousers
UNITS = {
    1e-3: "millimetres",
    1e-2: "centimetres",
    1e-1: "decimetres",
    1e1: "tens of metres",
    1e2: "hundreds of metres",
    1e3: "kilometres",
}
# Two sides are off by a unit if the ratio of their sizes is within this factor of 10, 100 or 1000.
NEAR = 1.25


def diagonal(track: Track) -> float:
    """Diagonal of the bounding box of the first frame, metres. A prediction may run away later."""
    return float(np.linalg.norm(np.ptp(track.positions[0], axis=0)))


def check_size(track: Track, option: str) -> None:
    """Raise InputError if a garment of unknown unit is too large or too small to be in metres.

    option   of the command line, with which its unit is told
    """
    size = diagonal(track)
    if track.units_known or SMALLEST <= size <= LARGEST:
        return
    scale = min(UNITS, key=lambda unit: abs(np.log(max(size, 1e-300) * unit / USUAL)))
    raise InputError(
        f"{track.name}: the garment is {size:.3g} m across, allowed are {SMALLEST:g} to {LARGEST:g} m; its "
        f"unit is likely {UNITS[scale]}: give {option} {scale:g} (or {option} 1 if it is metres)"
    )


def check_scales(prediction: Track, truth: Track) -> None:
    """Raise InputError if the sizes of the two sides differ by about 10, 100 or 1000, as units do."""
    if prediction.units_known:
        return
    mine, theirs = diagonal(prediction), diagonal(truth)
    scale = min(UNITS, key=lambda unit: abs(np.log(mine * unit / max(theirs, 1e-300))))
    if 1 / NEAR < mine * scale / max(theirs, 1e-300) < NEAR:
        raise InputError(
            f"{prediction.name} is {mine:.3g} m across and {truth.name} {theirs:.3g} m; the prediction is "
            f"likely in {UNITS[scale]}: give --scale {scale:g} (or --scale 1 if it is metres)"
        )
