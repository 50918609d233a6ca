"""The training loop of networks that learn from batches."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Protocol

import torch
from accelerate import Accelerator
from torch import Tensor, nn

from muslin.garments.errors import InputError
from muslin.learn.training.checkpoint import Progress, load_checkpoint, save_checkpoint
from muslin.learn.training.curve import draw_curve
from muslin.learn.training.machine import training_device
from muslin.sim.dataset import durable

Report = Callable[[float, int, str], None]
"""(steps done, steps in all, what is told beside them)."""

LOG, CURVE = "history.jsonl", "loss.png"
CHECKPOINT_S = 30.0
"""Between two checkpoints, at least: epochs may be short, and weights many."""


@dataclass(frozen=True)
class Settings:
    """How long and how: AdamW, linear warm-up over a share of the steps, then a cosine to zero.

    precision: "no" for float32, or "bf16", torch's automatic mix of both
    """

    epochs: int
    learning_rate: float
    weight_decay: float = 1e-2
    warm_up: float = 0.05
    clip: float = 1.0
    seed: int = 0
    precision: str = "no"

    def __post_init__(self) -> None:
        for name, least in (("epochs", 1), ("learning_rate", 1e-12), ("weight_decay", 0.0), ("clip", 1e-12)):
            if not getattr(self, name) >= least:
                raise InputError(f"{name} = {getattr(self, name)}; it must be at least {least:g}")
        if not 0.0 <= self.warm_up < 1.0:
            raise InputError(f"warm_up = {self.warm_up}; it must be from 0 to below 1")
        if self.precision not in ("no", "bf16"):
            raise InputError(f"precision = {self.precision!r}; it must be no or bf16")


class Objective(Protocol):
    """What is learned from what."""

    def steps(self) -> int:
        """Batches of an epoch."""

    def batches(self, epoch: int, rank: int, world: int) -> Iterator[Any]:
        """Those of one process of `world`; a function of the epoch and the rank alone."""

    def loss(self, model: nn.Module, batch: Any) -> Tensor:
        """Scalar."""

    def validate(self, model: nn.Module) -> dict[str, float]:
        """Figures that are logged after an epoch; without gradients, in evaluation mode."""

    def identity(self) -> Mapping[str, Any]:
        """What determines it, as JSON values: another one does not go on with the same checkpoint."""


def train(
    model: nn.Module,
    objective: Objective,
    settings: Settings,
    out: Path,
    *,
    report: Report | None = None,
    after: Callable[[nn.Module, int], None] | None = None,
) -> list[dict[str, float]]:
    """Train a model; return a row of figures for every epoch, and before them one for what it was (epoch 0).

    Every CHECKPOINT_S seconds and at the end `out` gets a checkpoint, from which the same call goes on to the
    same weights, the history as lines of JSON, and logs for TensorBoard; at the end the loss curve too.

    after: called with the model, in evaluation mode, and the number of epochs that are done, after each.

    Raises InputError if `out` holds another training, and if the loss is not finite.
    """
    durable.make_folder(out)
    accelerator = Accelerator(cpu=training_device().type == "cpu")
    optimizer = torch.optim.AdamW(
        model.parameters(), lr=settings.learning_rate, weight_decay=settings.weight_decay
    )
    run = {"settings": asdict(settings), **objective.identity()}
    progress = load_checkpoint(out, model, optimizer, run)
    wrapped, optimizer = accelerator.prepare(model, optimizer)
    rank, world = accelerator.process_index, accelerator.num_processes
    steps = objective.steps()
    step, total = progress.epochs * steps, settings.epochs * steps
    kept, stored = time.monotonic(), len(progress.history)
    if not progress.history:
        progress.history.append({"epoch": 0, **_validate(wrapped, objective, accelerator)})
    for epoch in range(progress.epochs, settings.epochs):
        wrapped.train()
        begun, losses = time.perf_counter(), []
        for batch in objective.batches(epoch, rank, world):
            for group in optimizer.param_groups:
                group["lr"] = settings.learning_rate * rate(step / total, settings.warm_up)
            with torch.autocast(accelerator.device.type, torch.bfloat16, settings.precision == "bf16"):
                loss = objective.loss(wrapped, batch)
            optimizer.zero_grad()
            accelerator.backward(loss)
            accelerator.clip_grad_norm_(wrapped.parameters(), settings.clip)
            optimizer.step()
            losses.append(loss.detach())
            step += 1
            if report is not None and accelerator.is_main_process:
                report(step, total, f"epoch {epoch + 1} of {settings.epochs}, loss {float(losses[-1]):.3g}")
        figures = _validate(wrapped, objective, accelerator)
        mean = float(accelerator.gather(torch.stack(losses).mean()[None]).mean())
        row = {"epoch": epoch + 1, "loss": mean, "seconds": time.perf_counter() - begun, **figures}
        if not math.isfinite(mean):
            raise InputError(f"{out}: the loss of epoch {epoch + 1} is {mean}; try a smaller learning_rate")
        if accelerator.is_main_process:
            progress.history.append(row)
            progress.epochs = epoch + 1
            if after is not None:
                after(accelerator.unwrap_model(wrapped), epoch + 1)
            if time.monotonic() - kept > CHECKPOINT_S or progress.epochs == settings.epochs:
                _keep(out, accelerator.unwrap_model(wrapped), optimizer.optimizer, progress, run, stored)
                kept, stored = time.monotonic(), len(progress.history)
    if accelerator.is_main_process:
        draw_curve(progress.history, out / CURVE)
    return progress.history


def _validate(wrapped: nn.Module, objective: Objective, accelerator: Accelerator) -> dict[str, float]:
    wrapped.eval()
    with torch.no_grad():
        return objective.validate(accelerator.unwrap_model(wrapped))


def rate(done: float, warm_up: float) -> float:
    """Share of the learning rate after a share of the steps."""
    if done < warm_up:
        return done / warm_up
    return 0.5 * (1.0 + math.cos(math.pi * (done - warm_up) / (1.0 - warm_up)))


def _keep(
    out: Path,
    model: nn.Module,
    optimizer: torch.optim.AdamW,
    progress: Progress,
    run: Mapping[str, Any],
    stored: int,
) -> None:
    """stored: rows that the logs have already."""
    from torch.utils.tensorboard import SummaryWriter

    save_checkpoint(out, model, optimizer, progress, run)
    lines = "".join(json.dumps(row) + "\n" for row in progress.history)
    durable.write_file(out / LOG, lines.encode())
    with SummaryWriter(str(out / "tensorboard"), purge_step=stored) as writer:
        for row in progress.history[stored:]:
            for key in row.keys() - {"epoch"}:
                writer.add_scalar(key, row[key], int(row["epoch"]))
