"""All families of metrics, by name."""

from __future__ import annotations

from collections.abc import Sequence

from muslin.eval.score.contact import BodyContact, Definitions, SelfContact
from muslin.eval.score.family import Family
from muslin.eval.score.motion import Motion
from muslin.eval.score.physics import Change, FabricEnergies, Strain
from muslin.eval.score.spectra import PanelSpectrum, Spectrum
from muslin.eval.score.surface import SurfaceDistances
from muslin.eval.score.vertex import Vertex
from muslin.eval.score.wrinkles import Curvature, Folds, Normals
from muslin.garments.errors import InputError

FAMILIES: dict[str, type[Family]] = {
    family.name: family
    for family in (
        Vertex,
        Motion,
        SurfaceDistances,
        Normals,
        Folds,
        Curvature,
        Spectrum,
        PanelSpectrum,
        Strain,
        Change,
        BodyContact,
        SelfContact,
        Definitions,
        FabricEnergies,
    )
}

STANDARD = tuple(name for name in FAMILIES if name not in (Definitions.name, FabricEnergies.name))
"""What is computed unless told otherwise: not energies, for which the simulator's kernels are loaded, and not
other definitions of penetration, which cost more than all the rest of a frame."""


def chosen(names: Sequence[str]) -> tuple[type[Family], ...]:
    """Families by name, in the order of `FAMILIES`; "standard" and "all" stand for several.

    Raises InputError for a name that is none of them, and for no name.
    """
    wanted: set[str] = set()
    for name in names:
        if name == "standard":
            wanted.update(STANDARD)
        elif name == "all":
            wanted.update(FAMILIES)
        elif name in FAMILIES:
            wanted.add(name)
        else:
            raise InputError(f"metrics: {name!r} is none; choose from standard, all, {', '.join(FAMILIES)}")
    if not wanted:
        raise InputError(f"metrics: none chosen; choose from standard, all, {', '.join(FAMILIES)}")
    return tuple(family for name, family in FAMILIES.items() if name in wanted)
