"""What a network sees of a fabric."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from muslin.sim.material import Fabric
from muslin.sim.setting import load_choice

FIGURES = 4


def fabric_figures(names: Sequence[str]) -> Tensor:
    """(N, 4) of N fabrics, by the names that scenes give them: logarithms to base 10 of

    density, kg/m^2; stiffness, the geometric mean of c11 and c22 in stretch and c33 in shear, N/m; rigidity,
    that of D11 and D22 in bending, N m; and (rigidity / (density g))^(1/3), metres, the length over which
    cloth bends under its own weight.
    """
    return torch.tensor([_figures(load_choice(name)) for name in names], dtype=torch.float32)


def file_stem(fabric: str) -> str:
    """A name for files of what was learned of a fabric, which may itself be a path."""
    return re.sub(r"[^\w.-]+", "_", fabric).strip("_")


def _figures(fabric: Fabric) -> list[float]:
    c11, _, c22, c33 = fabric.stretch_rest
    d11, _, d22, _ = fabric.rigidity[0]
    stretch, bend = np.cbrt(c11 * c22 * c33), np.sqrt(d11 * d22)
    return list(np.log10([fabric.density, stretch, bend, np.cbrt(bend / (fabric.density * 9.81))]))
