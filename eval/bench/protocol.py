"""What a benchmark scores, on which samples, and what it shows: a TOML file.

name = "unseen_designs"
title = "Designs that training has not seen"
source = "Whom to cite"
dataset = "out/data"                       # the truth; or --dataset
train = ["train"]                          # splits that methods learn from; scored only by a group's splits

families = ["vertex", "surface"]           # of metrics that are computed (muslin eval --metrics)

[select]                                   # which samples are scored; every group narrows this
kind = "drape"
where = { fabric = ["gray-interlock"] }    # labels of a sample: design, shape, fabric, sequence, topology …

[[groups]]                                 # samples that are told apart; without any, there is one, "all"
name = "seen"
title = "seen topologies"
seen = ["design", "topology"]              # of which the training splits hold the same
unseen = ["shape"]                         # of which they do not

[[metrics]]
figure = "hausdorff_mm"                    # a dotted path into the figures of `muslin eval --json`
title = "Hausdorff distance"
unit = "mm"

[[tables]]
title = "Hausdorff distance"
rows = ["group"]                           # of: method, group, metric, any label
columns = ["method"]
metrics = ["hausdorff_mm"]

[[figures]]
title = "Hausdorff distance against body shape"
x = "beta.0"                               # beta, beta.K, frame, time, any label
y = "hausdorff_mm"                         # over frame or time: a figure of single frames
lines = ["method", "group"]
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from muslin.garments.errors import InputError
from muslin.sim.dataset.config import Name
from muslin.sim.dataset.header import digest
from muslin.sim.table_errors import explain
from muslin.sim.toml_values import read_values

METHOD, GROUP, METRIC = "method", "group", "metric"
OVER_FRAMES = ("frame", "time")
BETA = "beta"
ALL = "all"

Text = Annotated[str, Field(min_length=1)]
Known = Literal["design", "shape", "fabric", "sequence", "topology", "garment", "body"]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Selection(_Strict):
    """Samples of a dataset.

    kind      drape or sequence; None takes both
    splits    names of splits; empty takes every split but those of `train`
    where     {label: values}: a sample's value must be one of them
    seen      the sample's value of the label is also that of a sample of the training splits
    unseen    it is that of none of them

    The topology of a sample is known by its faces, whatever a label calls it.
    """

    kind: Literal["drape", "sequence"] | None = None
    splits: list[Text] = []
    where: dict[str, list[str]] = {}
    seen: list[Known] = []
    unseen: list[Known] = []

    @model_validator(mode="after")
    def _possible(self) -> Selection:
        if both := sorted(set(self.seen) & set(self.unseen)):
            raise ValueError(f"{both[0]} cannot be both seen and unseen")
        return self


class Group(Selection):
    """Samples with a name; `title` is what tables and figures call it."""

    name: Name
    title: str = ""

    @property
    def label(self) -> str:
        return self.title or self.name


class Metric(_Strict):
    """A figure of each sample; in means every sample counts alike, whatever its frames and vertices are.

    better   lower, higher, or nearer to "one", such as a share of energy that was kept
    """

    figure: Text
    title: Text
    unit: str = ""
    better: Literal["lower", "higher", "one"] = "lower"

    @property
    def heading(self) -> str:
        return f"{self.title}, {self.unit}" if self.unit else self.title

    def loss(self, value: float) -> float:
        """Of which less is better."""
        if self.better == "one":
            return abs(value - 1.0)
        return value if self.better == "lower" else -value


class Table(_Strict):
    """Means over samples, with intervals; what is named neither in rows nor in columns is pooled."""

    title: Text
    rows: list[Text] = Field(min_length=1)
    columns: list[Text] = [METHOD]
    metrics: list[Text] = Field(min_length=1)
    groups: list[Name] = []

    @model_validator(mode="after")
    def _complete(self) -> Table:
        names = [*self.rows, *self.columns]
        _check_unique("rows and columns", names)
        if METHOD not in names:
            raise ValueError("method must be among rows or columns: methods are never pooled")
        if len(self.metrics) > 1 and METRIC not in names:
            raise ValueError("metric must be among rows or columns where a table has several metrics")
        return self


class Figure(_Strict):
    """Means over the samples at each x, with intervals.

    x        beta (the component that varies most), beta.K, frame, time (seconds), or a label
    y        a metric's figure; over frame or time, the name of a figure of single frames
    y_label  with unit; by default the metric's heading
    lines    what has a line of its own: method, group, any label
    each     a label: one plot for each of its values
    """

    title: Text
    x: Text
    y: Text
    y_label: str = ""
    lines: list[Text] = [METHOD]
    each: str | None = None
    groups: list[Name] = []

    @model_validator(mode="after")
    def _complete(self) -> Figure:
        if METHOD not in self.lines:
            raise ValueError("method must be among lines: methods are never pooled")
        _check_unique("lines", [*self.lines, *([self.each] if self.each else [])])
        if self.component is None and self.x.startswith(f"{BETA}."):
            raise ValueError(f"x = {self.x!r}: must be beta.K with a whole number K from 0, such as beta.0")
        if self.over_frames and not self.y_label:
            raise ValueError("y_label is missing: say what y is, with its unit")
        return self

    @property
    def over_frames(self) -> bool:
        return self.x in OVER_FRAMES

    @property
    def component(self) -> int | None:
        """K of beta.K."""
        head, _, tail = self.x.partition(".")
        return int(tail) if head == BETA and tail.isdigit() else None


class Bootstrap(_Strict):
    """cluster: a label whose values are drawn whole, such as design; None draws sample by sample."""

    confidence: float = Field(default=0.95, gt=0.5, lt=1)
    resamples: int = Field(default=10_000, ge=100, le=1_000_000)
    seed: int = Field(default=0, ge=0, lt=2**63)
    cluster: str | None = None


class Protocol(_Strict):
    """A benchmark; see the head of this file.

    families   of metrics that are computed, `muslin.eval.score.families`
    """

    name: Name
    title: Text
    source: Text
    dataset: str | None = None
    train: list[Text] = ["train"]
    families: list[Text] = Field(default=["standard"], min_length=1)
    surface_frames: int = Field(default=24, ge=1)
    select: Selection = Selection()
    groups: list[Group] = [Group(name=ALL)]
    metrics: list[Metric] = Field(min_length=1)
    tables: list[Table] = []
    figures: list[Figure] = []
    bootstrap: Bootstrap = Bootstrap()

    @model_validator(mode="after")
    def _consistent(self) -> Protocol:
        if not self.groups:
            raise ValueError("groups is empty; leave it out for one group of all samples")
        _check_unique("groups", [group.name for group in self.groups])
        _check_unique("metrics", [metric.figure for metric in self.metrics])
        known = [metric.figure for metric in self.metrics]
        for k, table in enumerate(self.tables):
            for figure in table.metrics:
                _check_one(f"tables.{k}.metrics", figure, known, "metrics")
        for k, plot in enumerate(self.figures):
            if not plot.over_frames:
                _check_one(f"figures.{k}.y", plot.y, known, "metrics")
        named = [(f"tables.{k}.groups", table.groups) for k, table in enumerate(self.tables)]
        named += [(f"figures.{k}.groups", plot.groups) for k, plot in enumerate(self.figures)]
        for key, names in named:
            for name in names:
                _check_one(key, name, [group.name for group in self.groups], "groups")
        return self

    @property
    def hash(self) -> str:
        """sha256 (hex) of everything but where the dataset lies: equal where the same is scored and shown."""
        return digest(self.model_dump(mode="json", exclude={"dataset"}))

    def metric(self, figure: str) -> Metric:
        return next(metric for metric in self.metrics if metric.figure == figure)


def load_protocol(path: str | Path) -> Protocol:
    """Read a protocol. Raises InputError naming file, key, value and what is allowed."""
    return parse_protocol(read_values(path, "protocol", (), ""), str(path))


def parse_protocol(values: dict[str, Any], source: str = "protocol") -> Protocol:
    """Check the values of a protocol's file. Raises InputError, one clause for each wrong key."""
    try:
        return Protocol.model_validate(values)
    except ValidationError as error:
        clauses = "; ".join(explain(entry, Protocol) for entry in error.errors())
        raise InputError(f"{source}: {clauses}") from error


def _check_unique(key: str, names: list[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"{key}: {name!r} is there twice; name each once")


def _check_one(key: str, name: str, allowed: list[str], where: str) -> None:
    if name not in allowed:
        raise ValueError(f"{key}: {name!r} is not in [[{where}]]; it has {', '.join(allowed)}")
