"""What the tables of scene files have in common."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Vector = tuple[Finite, Finite, Finite]
Count = Annotated[int, Field(ge=1, le=1000)]

ZERO: Vector = (0.0, 0.0, 0.0)


class Table(BaseModel):
    """Unknown keys are errors, and a table that was read does not change."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class RepeatTable(Table):
    """Copies in rows: `count` along x, y and z, each a `step` (metres) from the one before."""

    count: tuple[Count, Count, Count]
    step: Vector
