"""A captured motion on its own skeleton, as its file has it, turned to y up and facing +z."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SourceMotion:
    """joint_names      J names
    rest            (J, 3) joint positions with every rotation zero; any unit of length
    rotations       (T, J, 4) world rotations of the joints' frames
    positions       (T, J, 3) world positions of the joints, the unit of `rest`
    fps             frames per second
    """

    name: str
    joint_names: tuple[str, ...]
    rest: Array
    rotations: Array
    positions: Array
    fps: float
    source: str

    def index(self, joint: str) -> int:
        return self.joint_names.index(joint)
