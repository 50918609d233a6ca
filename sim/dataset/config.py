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

[[sequences]]                                   # the keys of a scene's [motion], and who makes it
clip = "cmu_07_01"
end = 4.0
designs = ["tshirt"]

[topologies]                                    # every drape in 20 more triangulations of its design
count = 20
target_area = [2.5e-4, 5e-4]

[splits.test]                                   # the first that names a sample takes it; the rest is "train"
designs = ["random-01*"]
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
from muslin.sim.dataset.presets import with_preset
from muslin.sim.motion_table import MotionSource, WalkTable, WarpTable
from muslin.sim.remesh.distortion import MAX_DISTORTION
from muslin.sim.scene import ExpectTable
from muslin.sim.toml_values import read_values, set_value

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


class MotionClip(MotionSource):
    """A motion on every design (or those named), on the mean shape (or those named), in the scene's mode of
    motion or in its own. Names may be patterns, as those of `Split`."""

    name: Name | None = None
    mode: Literal["dynamic", "quasi-static"] | None = None
    designs: list[str] | None = None
    shapes: list[str] | None = None


class Topologies(_Strict):
    """Every drape in `count` other triangulations of its design, t00, t01, …, the same in all its drapes.

    Each is drawn by the dataset's seed, the design's name and its own number, so that more of them change
    none. `target_area`: mean area of a triangle, m^2, or a range in which each draws its own. With mode "fit"
    they are fitted to the one drape of the design's own mesh, with "simulate" each is simulated itself;
    `keep_source`: whether the drape of the design's own mesh is a sample too, of topology "source".
    """

    count: int = Field(ge=1, le=1000)
    target_area: Annotated[float, Field(gt=0)] | tuple[Finite, Finite]
    max_distortion: float = Field(default=MAX_DISTORTION, gt=1, le=100)
    mode: Literal["fit", "simulate"] = "fit"
    keep_source: bool = True

    @model_validator(mode="after")
    def _range(self) -> Topologies:
        if isinstance(self.target_area, tuple) and not 0.0 < self.target_area[0] <= self.target_area[1]:
            raise ValueError(f"target_area = {list(self.target_area)} must be [low, high], above 0 m^2")
        return self


class Split(_Strict):
    """Names of designs, shapes, sequences and topologies, or a fraction of one of these, drawn by the seed.

    A name may be a pattern: `*` stands for anything, `?` for one character, `[13579]` for one of these. A
    drawn member stays in its split when the dataset is extended, so the share is met only on average.
    """

    designs: list[str] = []
    shapes: list[str] = []
    sequences: list[str] = []
    topologies: list[str] = []
    by: Literal["design", "shape", "sequence", "topology"] | None = None
    fraction: float | None = Field(default=None, gt=0, lt=1)

    @model_validator(mode="after")
    def _pair(self) -> Split:
        if (self.by is None) != (self.fraction is None):
            raise ValueError("give by and fraction together")
        return self


class DatasetConfig(_Strict):
    """A dataset. `chain` is the most shapes that follow one another along beta in one process."""

    name: Name = "dataset"
    seed: int = Field(default=0, ge=0, lt=2**63)
    kind: Literal["drape", "sequence", "both"] = "both"
    chain: int = Field(default=20, ge=1)
    scene: dict[str, Any] = {}
    designs: list[Design] = []
    shapes: list[Shape] = []
    fabrics: list[str] = []
    sequences: list[MotionClip] = []
    topologies: Topologies | None = None
    splits: dict[Name, Split] = {}
    expect: ExpectTable = ExpectTable()


def load_config(path: str | Path, overrides: Sequence[str] = (), preset: str | None = None) -> DatasetConfig:
    """Read a dataset's TOML file, one of its presets merged over it (`with_preset`), if one is asked for;
    `overrides`, which come last, are "dotted.key=value" with TOML values.

    Raises InputError naming file, key, value and what is allowed.
    """
    example = "scene.fabric=gray-interlock"
    values = with_preset(read_values(path, "dataset", (), example), preset, str(path))
    for override in overrides:
        set_value(values, override, example)
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


_TABLES: dict[str, type[BaseModel]] = {
    "designs": Design,
    "shapes": Shape,
    "sequences": MotionClip,
    "topologies": Topologies,
    "splits": Split,
    "sweep": Sweep,
    "warp": WarpTable,
    "random_walk": WalkTable,
}


def _keys_beside(location: tuple[Any, ...]) -> list[str]:
    model: type[BaseModel] = DatasetConfig
    for part in location[:-1]:
        if part == "random":
            model = RandomDesigns if model is Design else RandomShapes
        elif part in _TABLES:
            model = _TABLES[part]
    return list(model.model_fields)
