"""The configuration of a dataset: which designs, on which shapes, in which motions, split how.

name = "demo"
seed = 0
kind = "both"                                   # "drape", "sequence" or "both"

[scene]                                         # what all samples share; the keys of a scene file
garment = { design = "tee", template = 1400 }
body = { model = "female" }

[[designs]]                                     # one garment
name = "tshirt"
preset = "tshirt"
[[designs]]                                     # 20 garments, parameters drawn uniformly
name = "random"
random = { count = 20, ranges = { sleeve_length = [0.1, 0.6] } }

[[shapes]]
beta = [0.5, -1.0]                              # or random = { count, components, limit }
[[shapes]]                                      # 5 shapes along one component
sweep = { component = 0, start = -2.0, stop = 2.0, count = 5 }

[[sequences]]
clip = "cmu_07_01"
end = 4.0
designs = ["tshirt"]

[splits.test]                                   # the first that names a sample takes it; the rest is "train"
designs = ["random-019"]
[splits.validation]
by = "shape"
fraction = 0.1
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from muslin.garments.errors import InputError
from muslin.sim.scene import ExpectTable
from muslin.sim.toml_values import read_values

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$", max_length=60)]
Finite = Annotated[float, Field(allow_inf_nan=False)]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class RandomDesigns(_Strict):
    """`count` parameter sets; a parameter with a range [low, high] in metres is drawn uniformly from it.

    Without any range, every parameter is drawn from the whole range that the design allows.
    """

    count: int = Field(ge=1, le=1_000_000)
    ranges: dict[str, tuple[Finite, Finite]] = {}


class Design(_Strict):
    """One garment, or with `random` many: catalogue design, preset, parameters that override the preset
    (metres), and an edge length (metres) in place of the scene's."""

    name: Name | None = None
    design: str = "tee"
    preset: str | None = None
    parameters: dict[str, Finite] = {}
    edge_length: float | None = Field(default=None, gt=0, allow_inf_nan=False)
    random: RandomDesigns | None = None


class Sweep(_Strict):
    """`count` shapes along one component from start to stop (standard deviations), the others zero."""

    component: int = Field(ge=0, le=299)
    start: Finite
    stop: Finite
    count: int = Field(ge=2, le=100_000)


class RandomShapes(_Strict):
    """`count` shapes, the first `components` coefficients drawn uniformly from [-limit, limit]."""

    count: int = Field(ge=1, le=1_000_000)
    components: int = Field(default=10, ge=1, le=300)
    limit: float = Field(default=2.0, gt=0, le=5)


class Shape(_Strict):
    """Body shapes: exactly one of beta, sweep, random."""

    name: Name | None = None
    beta: list[Finite] | None = None
    sweep: Sweep | None = None
    random: RandomShapes | None = None

    @model_validator(mode="after")
    def _one(self) -> Shape:
        if sum(entry is not None for entry in (self.beta, self.sweep, self.random)) != 1:
            raise ValueError("give exactly one of beta, sweep, random")
        return self


class MotionClip(_Strict):
    """A motion on every design (or those named), on the mean shape (or those named)."""

    name: Name | None = None
    clip: str
    start: float = Field(default=0.0, ge=0, allow_inf_nan=False)
    end: float | None = Field(default=None, gt=0, allow_inf_nan=False)
    fps: float = Field(default=30.0, gt=0, le=1000)
    designs: list[str] | None = None
    shapes: list[str] | None = None

    @model_validator(mode="after")
    def _forward(self) -> MotionClip:
        if self.end is not None and self.end <= self.start:
            raise ValueError(f"end = {self.end} must be later than start = {self.start}")
        return self


class Split(_Strict):
    """Names of designs, shapes and sequences, or a fraction of one of the three, drawn by the seed.

    A drawn member stays in its split when the dataset is extended, so the share is met only on average.
    """

    designs: list[str] = []
    shapes: list[str] = []
    sequences: list[str] = []
    by: Literal["design", "shape", "sequence"] | None = None
    fraction: float | None = Field(default=None, gt=0, lt=1)

    @model_validator(mode="after")
    def _pair(self) -> Split:
        if (self.by is None) != (self.fraction is None):
            raise ValueError("give by and fraction together")
        return self


class DatasetConfig(_Strict):
    """A dataset. `chain` is the most drapes that follow one another along beta in one process."""

    name: Name = "dataset"
    seed: int = Field(default=0, ge=0, lt=2**63)
    kind: Literal["drape", "sequence", "both"] = "both"
    chain: int = Field(default=20, ge=1)
    scene: dict[str, Any] = {}
    designs: list[Design] = []
    shapes: list[Shape] = []
    fabrics: list[str] = []
    sequences: list[MotionClip] = []
    splits: dict[Name, Split] = {}
    expect: ExpectTable = ExpectTable()


def load_config(path: str | Path, overrides: Sequence[str] = ()) -> DatasetConfig:
    """Read a dataset's TOML file; `overrides` are "dotted.key=value" with TOML values.

    Raises InputError naming file, key, value and what is allowed.
    """
    values = read_values(path, "dataset", overrides, "scene.fabric=gray-interlock")
    return parse_config(values, str(path))


def parse_config(values: dict[str, Any], source: str = "dataset") -> DatasetConfig:
    """Check the values of a dataset's file. Raises InputError, one clause for each wrong key."""
    try:
        return DatasetConfig.model_validate(values)
    except ValidationError as error:
        clauses = [_explain(entry) for entry in error.errors()]
        raise InputError(f"{source}: {'; '.join(clauses)}") from error


def _explain(entry: Any) -> str:
    key = ".".join(str(part) for part in entry["loc"]) or "(whole file)"
    if entry["type"] == "extra_forbidden":
        return f"{key}: unknown key; allowed here: {', '.join(_keys_beside(entry['loc']))}"
    value = "" if isinstance(entry["input"], dict) else f" = {entry['input']!r}"
    return f"{key}{value}: {entry['msg'].removeprefix('Value error, ')}"


_TABLES: dict[str, type[_Strict]] = {
    "designs": Design,
    "shapes": Shape,
    "sequences": MotionClip,
    "splits": Split,
    "sweep": Sweep,
}


def _keys_beside(location: tuple[Any, ...]) -> list[str]:
    model: type[_Strict] = DatasetConfig
    for part in location[:-1]:
        if part == "random":
            model = RandomDesigns if model is Design else RandomShapes
        elif part in _TABLES:
            model = _TABLES[part]
    return list(model.model_fields)
