"""The cases, by the name that their file gives under `case`."""

from __future__ import annotations

from muslin.eval.validate.case import Case
from muslin.eval.validate.cases import (
    cantilever,
    catenary,
    drape,
    fabrics,
    flight,
    guarantee,
    hanging,
    incline,
    invariance,
    pendulum,
    rotation,
    stretch,
    support,
)

CASES = {
    "cantilever": Case(cantilever.Cantilever, cantilever.run),
    "hanging": Case(hanging.Hanging, hanging.run),
    "stretch": Case(stretch.Stretch, stretch.run),
    "fabrics": Case(fabrics.Fabrics, fabrics.run),
    "catenary": Case(catenary.Catenary, catenary.run),
    "incline": Case(incline.Incline, incline.run),
    "flight": Case(flight.Flight, flight.run),
    "pendulum": Case(pendulum.Pendulum, pendulum.run),
    "drape": Case(drape.Drape, drape.run),
    "rotation": Case(rotation.RotationCase, rotation.run),
    "invariance": Case(invariance.Invariance, invariance.run),
    "support": Case(support.Support, support.run),
    "guarantee": Case(guarantee.Guarantee, guarantee.run),
}
