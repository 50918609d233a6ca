"""The catalogue of designs. A new design is one file in `designs/`, one test file and one line here."""

from __future__ import annotations

from muslin.garments.design import Design
from muslin.garments.designs.sheet import SHEET
from muslin.garments.designs.tee import TEE
from muslin.garments.errors import InputError

DESIGNS: dict[str, Design] = {design.name: design for design in (TEE, SHEET)}


def names() -> tuple[str, ...]:
    """Names of all designs."""
    return tuple(DESIGNS)


def get(name: str) -> Design:
    """The design of that name; InputError if there is none."""
    if name not in DESIGNS:
        raise InputError(f"no design '{name}'; allowed: {', '.join(DESIGNS)}")
    return DESIGNS[name]
