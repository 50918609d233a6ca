"""The contenders, what each needs installed, and in what it differs from the others."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Contender:
    """`module` of this folder; `environment`: its folder among the peers' environments, none for muslin's
    own; `package` that must be installed there; `notes` for the reader of the table."""

    name: str
    module: str
    environment: str | None
    package: str
    notes: str

    def footnote(self, versions: dict[str, str], failure: str | None) -> list[str]:
        """Lines below a table: in which versions it ran, its notes, and how it ended if it did not get
        through."""
        ran = ", ".join(f"{name} {version}" for name, version in versions.items())
        lines = [f"- **{self.name}** ({ran}). {self.notes}"]
        if failure is not None:
            lines.append(f"  It did not get through: {failure.splitlines()[-1]}")
        return lines

    def interpreter(self, environments: Path) -> Path:
        """The Python that it runs with."""
        if self.environment is None:
            return Path(sys.executable)
        return (environments / self.environment / "bin" / "python").absolute()

    def missing(self, environments: Path) -> str | None:
        """Why it cannot run here, or None if it can."""
        python = self.interpreter(environments)
        if not python.exists():
            return f"there is no {python}; {self._remedy(environments)}"
        code = f"from importlib.metadata import version; version({self.package!r})"
        if subprocess.run([python, "-c", code], capture_output=True).returncode != 0:
            return f"{self.package} is not installed for {python}; {self._remedy(environments)}"
        return None

    def _remedy(self, environments: Path) -> str:
        if self.environment is None:
            return "make .venv"
        folder = environments / self.environment
        wanted = f"benchmarks/requirements/{self.environment}.txt"
        return f"python3.11 -m venv {folder} && {folder}/bin/pip install -r {wanted}"


MUSLIN = Contender(
    "muslin",
    "with_muslin",
    None,
    "muslin",
    "The measured fabric, stiffer when strained. One step of 1/60 s a frame. The collider is drawn in where "
    "the body cuts into itself and cloth is near; the time for that is counted.",
)

CONTENDERS = (
    MUSLIN,
    Contender(
        "Blender cloth",
        "blender",
        "blender",
        "bpy",
        "Springs along edges, so no warp and weft, and Poisson's ratio 1/3; rest lengths from a shape in "
        "space that fits the panels to 0.13% (root mean square). 5 steps a frame, 2 collision passes; the "
        "body is played from a PC2 cache under a collision modifier. The cloth starts closer to the body "
        "than its 3 mm of collision distance; in the armpits there is room for no more.",
    ),
    Contender(
        "newton Style3D",
        "newton_style3d",
        "newton",
        "newton",
        "Stiffness of warp, weft and shear at rest. Rest shapes from the panels. 10 substeps of 4 iterations "
        "a frame as in newton's `cloth_style3d`; contact as in `cloth_h1`, newton's garment on a moving "
        "robot. The body meets vertices of the cloth alone, not its edges and triangles.",
    ),
    Contender(
        "newton VBD",
        "newton_vbd",
        "newton",
        "newton",
        "Isotropic, the mean of warp and weft at rest. Rest shapes from the panels. 10 substeps of 5 "
        "iterations a frame as in newton's `cloth_franka`, self-contact as in `cloth_twist`. The body meets "
        "vertices of the cloth alone, not its edges and triangles.",
    ),
)


def named(names: str, contenders: tuple[Contender, ...] = CONTENDERS) -> tuple[Contender, ...]:
    """Those whose modules a comma-separated list names, muslin first; ValueError for unknown ones."""
    wanted = {name.strip() for name in names.split(",")}
    known = {contender.module for contender in contenders}
    if not wanted <= known:
        raise ValueError(
            f"no contender {', '.join(sorted(wanted - known))}; choose from {', '.join(sorted(known))}"
        )
    return tuple(c for c in contenders if c.module in wanted or c is contenders[0])
