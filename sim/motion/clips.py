"""Motions by name or path: the committed clips, or a user's AMASS file."""

from __future__ import annotations

from pathlib import Path

from numpy.typing import ArrayLike

from muslin.garments.errors import InputError
from muslin.sim.motion.amass import read_amass
from muslin.sim.motion.motion import Motion

ASSETS = Path(__file__).parent / "assets"


def motion_names() -> tuple[str, ...]:
    """Names of the committed clips; docs/motion-clips.md tells what each shows."""
    return tuple(sorted(path.stem for path in ASSETS.glob("*.npz")))


def load_motion(name_or_path: str | Path, rest_pelvis: ArrayLike = (0.0, 0.0, 0.0)) -> Motion:
    """A committed clip by name, or an AMASS .npz file (SMPL-H or SMPL-X) by path.

    Translations are for a body whose rest pelvis is at `rest_pelvis` (3,) metres: the origin for the default
    bodies. `fit_to_body` moves a motion onto another body and puts the floor under its feet.

    Raises:
        InputError: unknown name, missing file, or a file that is no AMASS motion.
    """
    name = str(name_or_path)
    if name in motion_names():
        return read_amass(ASSETS / f"{name}.npz", rest_pelvis, name=name)
    if Path(name).suffix.lower() != ".npz":
        raise InputError(
            f"motion {name!r} is unknown; allowed are {', '.join(motion_names())}, "
            f"or the path of an AMASS .npz file"
        )
    return read_amass(name, rest_pelvis)
