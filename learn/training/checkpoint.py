"""The state of a training in one file of tensors: weights, optimizer, and how far it has come. No pickles."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor, nn

from muslin.garments.errors import InputError
from muslin.sim.dataset import durable

FILE = "checkpoint.safetensors"
_STATE = ("step", "exp_avg", "exp_avg_sq")
"""Of AdamW, a parameter."""


@dataclass
class Progress:
    """epochs: that are done; history: a row of figures for each of them."""

    epochs: int = 0
    history: list[dict[str, float]] = field(default_factory=list)


def save_checkpoint(
    folder: Path, model: nn.Module, optimizer: torch.optim.AdamW, progress: Progress, run: Mapping[str, Any]
) -> None:
    """Replace the checkpoint of a folder in one step; run: what determines the training, as JSON values."""
    tensors = {f"model.{name}": value for name, value in model.state_dict().items()}
    for name, parameter in model.named_parameters():
        if parameter in optimizer.state:
            tensors |= {f"{key}.{name}": optimizer.state[parameter][key] for key in _STATE}
    told = {"epochs": progress.epochs, "history": progress.history, "run": dict(run)}
    write_tensors(folder / FILE, tensors, told)


def load_checkpoint(
    folder: Path, model: nn.Module, optimizer: torch.optim.AdamW, run: Mapping[str, Any]
) -> Progress:
    """Put model and optimizer back to where the checkpoint of a folder has them; the start, without one.

    Raises InputError if it is damaged, or of a training with other settings.
    """
    file = folder / FILE
    if not file.exists():
        return Progress()
    tensors, told = read_tensors(file)
    if told["run"] != json.loads(json.dumps(dict(run))):
        changed = [key for key in run if told["run"].get(key) != json.loads(json.dumps(run[key]))]
        raise InputError(
            f"{folder}: holds a training with another {', '.join(changed) or 'number of settings'}; give "
            "another folder, or remove this one"
        )
    model.load_state_dict({name: tensors[f"model.{name}"] for name in model.state_dict()})
    for name, parameter in model.named_parameters():
        if f"step.{name}" in tensors:
            own = {key: tensors[f"{key}.{name}"] for key in _STATE}
            optimizer.state[parameter] = {
                key: value.to(_device(key, parameter)) for key, value in own.items()
            }
    return Progress(told["epochs"], told["history"])


def read_tensors(file: Path) -> tuple[dict[str, Tensor], dict[str, Any]]:
    """{name: tensor} of a safetensors file, and what was told with them. Raises InputError if damaged."""
    try:
        with safe_open(file, framework="pt") as opened:
            told = json.loads((opened.metadata() or {})["told"])
            return {name: opened.get_tensor(name) for name in opened.keys()}, told  # noqa: SIM118
    except (SafetensorError, OSError, KeyError, ValueError) as error:
        raise InputError(f"{file}: not readable ({error}); remove it, or restore it from a copy") from error


def write_tensors(file: Path, tensors: Mapping[str, Tensor], told: Mapping[str, Any]) -> None:
    """A file for `read_tensors`, in one step; told: JSON values."""
    own = {name: value.detach().cpu().contiguous() for name, value in tensors.items()}
    durable.write_file(file, save(own, {"told": json.dumps(told, sort_keys=True)}))


def _device(key: str, parameter: nn.Parameter) -> torch.device:
    """The count of steps stays on the CPU, as AdamW keeps it."""
    return torch.device("cpu") if key == "step" else parameter.device
