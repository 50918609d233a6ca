"""What a method costs: time a frame, memory, parameters, size on disk; kept beside its prediction."""

from __future__ import annotations

import json
import math
import os
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from muslin.eval.memory import PeakMemory
from muslin.garments.errors import InputError

COST_FILE = "cost.json"
WARM_UP = 3


@dataclass(frozen=True)
class Cost:
    """Cost of one method on one device; None where a figure is not known.

    milliseconds_per_frame       median wall time of one frame, without preprocessing
    milliseconds_preprocessing   wall time of what is done once a sequence or garment, before the first frame
    peak_memory_bytes            largest resident memory of the process and its children; a device's own is
                                 not in it
    parameters                   number of trained numbers
    file_bytes                   size of the files of the trained model
    device                       where it ran, in words
    repeats                      number of frames timed
    """

    milliseconds_per_frame: float | None = None
    milliseconds_preprocessing: float | None = None
    peak_memory_bytes: int | None = None
    parameters: int | None = None
    file_bytes: int | None = None
    device: str | None = None
    repeats: int | None = None

    def milliseconds_with_preprocessing(self, frames: int) -> float | None:
        """Milliseconds a frame of a sequence of `frames`, preprocessing shared out among them."""
        if frames < 1:
            raise InputError(f"frames = {frames}: must be 1 or more")
        if self.milliseconds_per_frame is None or self.milliseconds_preprocessing is None:
            return None
        return self.milliseconds_per_frame + self.milliseconds_preprocessing / frames


@dataclass(frozen=True)
class Timing:
    """Times of single frames, milliseconds.

    median, quartiles         of wall time (`time.perf_counter`)
    process_median            of processor time of this process alone, all its threads (`time.process_time`):
                              well below `median` where others took the processor, or where a device did the
                              work
    preprocessing             wall time of `prepare`
    preprocessing_process     its processor time
    repeats                   number of frames timed
    peak_memory_bytes         largest resident memory meanwhile, of this process and its children
    """

    median: float
    quartiles: tuple[float, float]
    process_median: float
    preprocessing: float
    preprocessing_process: float
    repeats: int
    peak_memory_bytes: int


def measure(
    prepare: Callable[[], Any], step: Callable[[int], Any], frames: int, warm_up: int = WARM_UP
) -> Timing:
    """Time `prepare()` once, then `step(i)` for frames i = 0 .. frames - 1, after `warm_up` unrecorded ones.

    The warm-up runs steps 0, 1, ... (modulo `frames`), so a method with a state is to reset itself at step 0.
    A step must not return before its work is done: synchronise a device within it.
    """
    if frames < 1 or warm_up < 0:
        raise InputError(
            f"frames = {frames}, warm_up = {warm_up}: give at least one frame, and no less than 0"
        )
    with PeakMemory() as memory:
        preprocessing, preprocessing_process = _timed(prepare)
        for i in range(warm_up):
            step(i % frames)
        times = np.array([_timed(lambda i=i: step(i)) for i in range(frames)])  # type: ignore[misc]
    low, median, high = np.quantile(times[:, 0], [0.25, 0.5, 0.75])
    return Timing(
        median=float(median),
        quartiles=(float(low), float(high)),
        process_median=float(np.median(times[:, 1])),
        preprocessing=preprocessing,
        preprocessing_process=preprocessing_process,
        repeats=frames,
        peak_memory_bytes=memory.peak,
    )


def cost_of(
    timing: Timing | None = None,
    model: Any = None,
    folder: str | Path | None = None,
    device: str | None = None,
) -> Cost:
    """The cost of a method: its timing, the parameters of its model, the size of its folder, where known."""
    return Cost(
        milliseconds_per_frame=None if timing is None else timing.median,
        milliseconds_preprocessing=None if timing is None else timing.preprocessing,
        peak_memory_bytes=None if timing is None else timing.peak_memory_bytes,
        parameters=None if model is None else count_parameters(model),
        file_bytes=None if folder is None else folder_bytes(folder),
        device=device,
        repeats=None if timing is None else timing.repeats,
    )


def count_parameters(model: Any) -> int:
    """Number of numbers in a model: a module with `parameters()`, an array, or mappings and sequences of
    them.

    An array is anything with `numel()` (torch) or `size` (numpy). One that occurs twice counts once.
    """
    seen: dict[int, int] = {}
    for array in _arrays(model):
        seen[id(array)] = int(array.numel()) if callable(getattr(array, "numel", None)) else int(array.size)
    return sum(seen.values())


def _arrays(model: Any) -> Iterator[Any]:
    if callable(getattr(model, "parameters", None)):
        yield from model.parameters()
    elif callable(getattr(model, "numel", None)) or isinstance(getattr(model, "size", None), int):
        yield model
    elif isinstance(model, dict):
        for part in model.values():
            yield from _arrays(part)
    elif isinstance(model, Iterable) and not isinstance(model, (str, bytes)):
        for part in model:
            yield from _arrays(part)
    else:
        raise InputError(
            f"cannot count the parameters of a {type(model).__name__}; give a module with parameters(), "
            "arrays with numel() or size, or a mapping or sequence of these"
        )


def folder_bytes(path: str | Path) -> int:
    """Size of a file, or of all files below a folder, bytes; a file linked to twice counts once."""
    root = Path(path)
    if not root.exists():
        raise InputError(f"{root} does not exist; give a model's file or folder")
    files = [root] if root.is_file() else [entry for entry in root.rglob("*") if entry.is_file()]
    sizes = {(status.st_dev, status.st_ino): status.st_size for status in map(os.stat, files)}
    return sum(sizes.values())


def write_cost(cost: Cost, folder: str | Path) -> Path:
    """Write `cost.json` into the folder of a prediction; its path."""
    root = Path(folder)
    if not root.is_dir():
        raise InputError(f"{root} is no folder; give the folder of the prediction")
    path = root / COST_FILE
    _check(asdict(cost), path)
    path.write_text(json.dumps(asdict(cost), indent=1, allow_nan=False) + "\n")
    return path


def read_cost(folder: str | Path) -> Cost | None:
    """The `cost.json` in the folder of a prediction; None if there is none.

    Raises InputError for what is not JSON, unknown keys, and figures that are no number, negative or not
    finite.
    """
    path = Path(folder) / COST_FILE
    if not path.is_file():
        return None
    try:
        values = json.loads(path.read_text())
    except (ValueError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not JSON ({error}); write it with muslin.eval.cost.write_cost") from error
    if not isinstance(values, dict):
        raise InputError(f"{path}: a {type(values).__name__}; give an object with keys {', '.join(_NAMES)}")
    _check(values, path)
    return Cost(**values)


_NAMES = tuple(field.name for field in fields(Cost))
_WHOLE = ("peak_memory_bytes", "parameters", "file_bytes", "repeats")


def _check(values: dict[str, Any], path: Path) -> None:
    unknown = [name for name in values if name not in _NAMES]
    if unknown:
        raise InputError(f"{path}: unknown key {unknown[0]!r}; the keys are {', '.join(_NAMES)}")
    for name, value in values.items():
        if value is None:
            continue
        if name == "device":
            if not isinstance(value, str) or not value:
                raise InputError(f"{path}: device = {value!r}; name the device in words, or leave it out")
        elif isinstance(value, bool) or not isinstance(value, (int, float)):
            raise InputError(f"{path}: {name} = {value!r}; give a number, or leave it out")
        elif not math.isfinite(value) or value < 0:
            raise InputError(f"{path}: {name} = {value}; must be finite and not negative")
        elif name in _WHOLE and value != int(value):
            raise InputError(f"{path}: {name} = {value}; must be a whole number")


def _timed(work: Callable[[], Any]) -> tuple[float, float]:
    """Wall and processor time of a call, milliseconds."""
    wall, process = time.perf_counter(), time.process_time()
    work()
    return 1e3 * (time.perf_counter() - wall), 1e3 * (time.process_time() - process)
