"""From a configuration to the samples to make: the same list for the same configuration, on any machine."""

from __future__ import annotations

import copy
import hashlib
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from muslin.garments import catalogue
from muslin.garments.errors import InputError
from muslin.sim.dataset.config import DatasetConfig, Design, MotionClip, Shape, Split, Topologies
from muslin.sim.dataset.header import digest
from muslin.sim.dataset.jobs import Chain, Job, Plan

TRAIN = "train"
MEAN_SHAPE = "mean"
SOURCE_TOPOLOGY = "source"
"""The topology label of drapes on a design's own mesh, where they are given on others too."""


@dataclass(frozen=True)
class _Garment:
    name: str
    values: dict[str, Any]


@dataclass(frozen=True)
class _Beta:
    name: str
    beta: list[float] | None


@dataclass(frozen=True)
class _Topology:
    """A label, and the table of the scene; without a label where a dataset has no topologies."""

    label: str
    table: dict[str, Any] | None


def plan(config: DatasetConfig) -> Plan:
    """All chains of a dataset.

    Raises InputError for names that nothing has, parameters out of range, two samples that are the same, and
    a configuration without any sample.
    """
    designs = list(_designs(config))
    shapes = list(_shapes(config))
    clips = [(clip.name or clip.usual_name, clip) for clip in config.sequences]
    _check_unique("designs", [garment.name for garment in designs])
    _check_unique("shapes", [shape.name for shape in shapes])
    _check_unique("sequences", [name for name, _ in clips])
    _check_splits(config, designs, shapes, [name for name, _ in clips])
    fabrics: list[str | None] = [*config.fabrics] or [None]
    chains: list[Chain] = []
    for garment in designs:
        for fabric in fabrics:
            if config.kind in ("drape", "both"):
                chains += _drapes(config, garment, fabric, shapes)
            if config.kind in ("sequence", "both"):
                chains += _sequences(config, garment, fabric, shapes, clips)
    result = Plan(tuple(chains))
    _check_jobs(config, result)
    return result


def _drapes(
    config: DatasetConfig, garment: _Garment, fabric: str | None, shapes: Sequence[_Beta]
) -> Iterator[Chain]:
    for together in _topologies(config, garment):
        for first in range(0, len(shapes), config.chain):
            jobs: list[Job] = []
            before: list[Any] = []
            for shape in shapes[first : first + config.chain]:
                for topology in together:
                    scene = _scene(config, garment, fabric, shape, None)
                    if topology.table is not None:
                        scene["topology"] = topology.table
                    labels = {"design": garment.name, "shape": shape.name, "fabric": fabric or ""}
                    labels["topology"] = topology.label
                    # A drape starts from its neighbour's, so what came before it is part of what it is.
                    jobs.append(_job(config, "drape", scene, labels, {"scene": scene, "before": before}))
                before = [*before, shape.beta]
            yield Chain(tuple(jobs))


def _topologies(config: DatasetConfig, garment: _Garment) -> list[list[_Topology]]:
    """The topologies in which a garment is to be draped, those of one simulation together."""
    asked = config.topologies
    if asked is None:
        return [[_Topology("", None)]]
    source = [_Topology(SOURCE_TOPOLOGY, None)] if asked.keep_source else []
    drawn = [_drawn_topology(config, asked, garment, k) for k in range(asked.count)]
    if asked.mode == "fit":
        return [source + drawn]
    return [[topology] for topology in source + drawn]


def _drawn_topology(config: DatasetConfig, asked: Topologies, garment: _Garment, number: int) -> _Topology:
    draw = _generator(config.seed, "topology", garment.name, str(number))
    area = asked.target_area
    if isinstance(area, tuple):
        area = float(f"{area[0] + (area[1] - area[0]) * draw.random():.3g}")
    seed = int(draw.integers(2**31))
    table = {"seed": seed, "target_area": area, "max_distortion": asked.max_distortion}
    return _Topology(f"t{number:02d}", table | {"fit": asked.mode == "fit"})


def _sequences(
    config: DatasetConfig,
    garment: _Garment,
    fabric: str | None,
    shapes: Sequence[_Beta],
    clips: Sequence[tuple[str, MotionClip]],
) -> Iterator[Chain]:
    for name, clip in clips:
        if clip.designs is not None and not _named(garment.name, clip.designs):
            continue
        wanted = (
            [shape for shape in shapes if _named(shape.name, clip.shapes)]
            if clip.shapes is not None
            else [_Beta(MEAN_SHAPE, None)]
        )
        for shape in wanted:
            scene = _scene(config, garment, fabric, shape, clip)
            labels = {"design": garment.name, "shape": shape.name, "sequence": name, "fabric": fabric or ""}
            yield Chain((_job(config, "sequence", scene, labels, {"scene": scene}),))


def _scene(
    config: DatasetConfig, garment: _Garment, fabric: str | None, shape: _Beta, clip: MotionClip | None
) -> dict[str, Any]:
    scene = copy.deepcopy(config.scene)
    scene.pop("expect", None)
    motion = scene.pop("motion", None) or {}
    if garment.values:
        kept = {k: v for k, v in scene.get("garment", {}).items() if k not in _GARMENT_SOURCES}
        scene["garment"] = kept | garment.values
    if shape.beta is not None:
        scene["body"] = scene.get("body", {}) | {"beta": shape.beta}
    if fabric is not None:
        scene["fabric"] = fabric
    if clip is not None:
        given = clip.model_dump(mode="json", exclude_defaults=True, exclude={"name", "designs", "shapes"})
        scene["motion"] = motion | {"start": clip.start, "fps": clip.fps} | given
    return scene


_GARMENT_SOURCES = ("design", "preset", "parameters", "pattern", "mesh")


_ID_LABELS = ("design", "shape", "sequence", "topology")


def _job(
    config: DatasetConfig, kind: str, scene: dict[str, Any], labels: dict[str, str], identity: dict[str, Any]
) -> Job:
    words = [re.sub(r"[^A-Za-z0-9-]+", "-", labels.get(key, "")) for key in _ID_LABELS]
    sample_id = "_".join([*filter(None, words), digest(identity)[:12]])
    return Job(
        sample_id, kind, scene, {k: v for k, v in labels.items() if v}, _split(config, labels), config.seed
    )


def _designs(config: DatasetConfig) -> Iterator[_Garment]:
    """The garments of all blocks; without any block, the garment of the base scene."""
    if not config.designs:
        yield _Garment("garment", {})
    for place, block in enumerate(config.designs):
        name = block.name or block.preset or f"design{place}"
        drawn = list(_parameters(config, place, block))
        for k, parameters in enumerate(drawn):
            values: dict[str, Any] = {"design": block.design, "parameters": parameters}
            if block.edge_length is not None:
                values["edge_length"] = block.edge_length
            yield _Garment(name if block.random is None else f"{name}-{k:03d}", values)


def _parameters(config: DatasetConfig, place: int, block: Design) -> Iterator[dict[str, float]]:
    where = f"designs.{place}"
    try:
        family = catalogue.get(block.design)
        given = (family.preset(block.preset) if block.preset else {}) | block.parameters
        fixed = family.complete(given)
    except InputError as error:
        raise InputError(f"{where}: {error}") from error
    if block.random is None:
        yield fixed
        return
    everything = {key: (p.low, p.high) for key, p in family.parameters.items() if key not in block.parameters}
    ranges = block.random.ranges or everything
    for key, (low, high) in ranges.items():
        known = family.parameters.get(key)
        if known is None:
            raise InputError(
                f"{where}.random.ranges.{key}: unknown parameter; allowed: {', '.join(family.parameters)}"
            )
        if not known.low <= low <= high <= known.high:
            raise InputError(
                f"{where}.random.ranges.{key} = [{low}, {high}]: must be [low, high] inside "
                f"[{known.low}, {known.high}] {known.unit}"
            )
    draw = _generator(config.seed, "design", block.name or str(place))
    for _ in range(block.random.count):
        # One draw for every parameter, ranged or not: adding a range leaves the other parameters' draws as
        # they were.
        u = {key: draw.random() for key in family.parameters}
        drawn = {key: _between(low, high, u[key]) for key, (low, high) in ranges.items()}
        yield fixed | drawn


def _shapes(config: DatasetConfig) -> Iterator[_Beta]:
    """The shapes of all blocks; without any block, the body of the base scene."""
    if not config.shapes:
        yield _Beta("base", None)
    for place, block in enumerate(config.shapes):
        name = block.name or f"shape{place}"
        if block.beta is not None:
            yield _Beta(name, list(block.beta))
            continue
        for k, beta in enumerate(_betas(config, block, name)):
            yield _Beta(f"{name}-{k:03d}", beta)


def _betas(config: DatasetConfig, block: Shape, name: str) -> Iterator[list[float]]:
    if block.sweep is not None:
        sweep = block.sweep
        for value in np.linspace(sweep.start, sweep.stop, sweep.count):
            yield [0.0] * sweep.component + [round(float(value), 6)]
    elif block.random is not None:
        draw = _generator(config.seed, "shape", name)
        limit = block.random.limit
        for _ in range(block.random.count):
            yield [_between(-limit, limit, draw.random()) for _ in range(block.random.components)]


def _between(low: float, high: float, u: float) -> float:
    # Four decimals (0.1 mm, 1e-4 standard deviations) keep configs and reports readable.
    return min(max(round(low + (high - low) * u, 4), low), high)


def _generator(seed: int, *words: str) -> np.random.Generator:
    """Every block draws from a stream of its own, so that extending one block changes no other."""
    return np.random.default_rng(list(hashlib.sha256("/".join([str(seed), *words]).encode()).digest()))


def _named(name: str, patterns: Sequence[str]) -> bool:
    return any(fnmatchcase(name, pattern) for pattern in patterns)


def _split(config: DatasetConfig, labels: dict[str, str]) -> str:
    for name, split in config.splits.items():
        for key, patterns in _split_names(split).items():
            if labels.get(key) and _named(labels[key], patterns):
                return name
        if split.by is not None and split.fraction is not None and labels.get(split.by):
            member = digest([config.seed, name, split.by, labels[split.by]])
            if int(member[:13], 16) < split.fraction * 16**13:
                return name
    return TRAIN


def _split_names(split: Split) -> dict[str, list[str]]:
    return {
        "design": split.designs,
        "shape": split.shapes,
        "sequence": split.sequences,
        "topology": split.topologies,
    }


def _check_unique(key: str, names: Sequence[str]) -> None:
    twice = sorted({name for name in names if names.count(name) > 1}) if len(set(names)) < len(names) else []
    if twice:
        raise InputError(f"{key}: two of them are named {twice[0]!r}; give each a name of its own")


def _check_splits(
    config: DatasetConfig, designs: Sequence[_Garment], shapes: Sequence[_Beta], sequences: Sequence[str]
) -> None:
    known = {
        "design": {garment.name for garment in designs},
        "shape": {shape.name for shape in shapes} | {MEAN_SHAPE},
        "sequence": set(sequences),
        "topology": {t.label for group in _topologies(config, designs[0]) for t in group} - {""},
    }
    for place, clip in enumerate(config.sequences):
        _check_names(f"sequences.{place}.designs", clip.designs or [], known["design"])
        _check_names(f"sequences.{place}.shapes", clip.shapes or [], known["shape"] - {MEAN_SHAPE})
    for name, split in config.splits.items():
        for key, patterns in _split_names(split).items():
            plural = "topologies" if key == "topology" else f"{key}s"
            _check_names(f"splits.{name}.{plural}", patterns, known[key])


def _check_names(key: str, patterns: Sequence[str], allowed: set[str]) -> None:
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in allowed):
            some = ", ".join(sorted(allowed)[:8]) or "none"
            raise InputError(f"{key}: {pattern!r} is the name of none; allowed: {some}")


def _check_jobs(config: DatasetConfig, result: Plan) -> None:
    jobs = result.jobs
    if not jobs:
        raise InputError(f"{config.name}: kind = {config.kind!r} leaves no sample to make; add [[sequences]]")
    seen: dict[str, Job] = {}
    for job in jobs:
        if job.id in seen:
            raise InputError(f"{config.name}: two samples are the same ({job.id}); remove one of them")
        seen[job.id] = job
