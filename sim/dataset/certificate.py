"""What was verified of a sample when it was made."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any

from muslin.garments.errors import InputError


@dataclass(frozen=True)
class Certificate:
    """What the producer of a sample measured of it, and what it cost.

    Intersections are counted on the stored (float32) positions, over all frames. A figure that was not
    measured is None; `muslin verify` counts the intersections again and trusts nothing here.

    cloth_cloth_intersections    pairs (edge, triangle) of the cloth that cross
    cloth_body_intersections     pairs (edge, triangle), one of cloth and one of unmasked body, that cross
    min_distance_m               smallest distance of cloth to itself (not adjacent) or the collider, metres,
                                 as the solver saw it; only pairs within its contact range count
    masked_body_faces_max        most faces of the body, between parts of it, that cloth crosses in any frame
    force_residual               largest norm of the residual force, as a share of the garment's weight
    largest_strain               largest principal stretch minus one, dimensionless
    """

    cloth_cloth_intersections: int | None = None
    cloth_body_intersections: int | None = None
    min_distance_m: float | None = None
    masked_body_faces_max: int = 0
    force_residual: float | None = None
    largest_strain: float | None = None
    seed: int = 0
    config_hash: str = ""
    seconds: float = 0.0
    versions: dict[str, str] = field(default_factory=dict)
    extra: dict[str, Any] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON. Raises InputError for what JSON cannot hold (NaN, infinity, an array)."""
        values = asdict(self)
        for key, value in values.items():
            try:
                json.dumps(value, allow_nan=False)
            except (TypeError, ValueError) as error:
                raise InputError(
                    f"certificate: {key} = {value!r} cannot be stored ({error}); "
                    "give finite plain values, or None for what was not measured"
                ) from error
        return values

    @staticmethod
    def from_dict(values: Mapping[str, Any]) -> Certificate:
        """The inverse of `to_dict`; keys that this version does not know are kept in `extra`."""
        known = {entry.name for entry in fields(Certificate)}
        unknown = {key: value for key, value in values.items() if key not in known}
        certificate = Certificate(**{key: value for key, value in values.items() if key in known})
        return replace(certificate, extra={**certificate.extra, **unknown})
