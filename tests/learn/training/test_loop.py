import json
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import nn

from muslin.garments.errors import InputError
from muslin.learn.training import loop
from muslin.learn.training.checkpoint import FILE, read_tensors
from muslin.learn.training.loop import Settings, rate, train

SETTINGS = Settings(epochs=6, learning_rate=1e-2)


class Line:
    """y = 2 x - 1, from a batch of points."""

    def __init__(self, stop_after: int | None = None, poison: bool = False) -> None:
        self.stop_after, self.poison = stop_after, poison

    def steps(self) -> int:
        return 5

    def batches(self, epoch: int, rank: int, world: int) -> Iterator[torch.Tensor]:
        if epoch == self.stop_after:
            raise KeyboardInterrupt
        draw = np.random.default_rng([0, epoch])
        for _ in range(self.steps()):
            yield torch.from_numpy(draw.uniform(-1.0, 1.0, (16, 1)).astype(np.float32))

    def loss(self, model: nn.Module, batch: torch.Tensor) -> torch.Tensor:
        error = (model(batch) - (2.0 * batch - 1.0)).square().mean()
        return error * torch.nan if self.poison else error

    def validate(self, model: nn.Module) -> dict[str, float]:
        assert not model.training
        return {"at_zero": float(model(torch.zeros(1, 1)))}

    def identity(self) -> dict[str, str]:
        return {"line": "2 x - 1"}


def network() -> nn.Module:
    torch.manual_seed(0)
    return nn.Sequential(nn.Linear(1, 8), nn.Tanh(), nn.Linear(8, 1))


def test_learns_and_leaves_a_history_a_curve_and_logs(tmp_path: Path) -> None:
    calls = []
    history = train(network(), Line(), SETTINGS, tmp_path, report=lambda *told: calls.append(told))
    assert [row["epoch"] for row in history] == [0, 1, 2, 3, 4, 5, 6]
    assert history[-1]["loss"] < 0.5 * history[1]["loss"]
    assert [json.loads(line) for line in (tmp_path / "history.jsonl").read_text().splitlines()] == history
    assert (tmp_path / "loss.png").read_bytes().startswith(b"\x89PNG")
    assert list((tmp_path / "tensorboard").iterdir())
    assert (calls[0][:2], calls[-1][:2]) == ((1, 30), (30, 30))
    assert "epoch 6 of 6" in calls[-1][2]


@pytest.mark.parametrize("seconds", [0.0, 1e9])
@pytest.mark.parametrize("stopped", [0, 1, 4])
def test_goes_on_to_the_same_bits(
    stopped: int, seconds: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(loop, "CHECKPOINT_S", seconds)
    whole, parts = network(), network()
    straight = train(whole, Line(), SETTINGS, tmp_path / "whole")
    with pytest.raises(KeyboardInterrupt):
        train(parts, Line(stop_after=stopped), SETTINGS, tmp_path / "parts")
    assert (tmp_path / "parts" / FILE).exists() == (stopped > 0 and seconds == 0.0)
    resumed = network()
    again = train(resumed, Line(), SETTINGS, tmp_path / "parts")
    for name, value in whole.state_dict().items():
        assert torch.equal(value, resumed.state_dict()[name])
    assert [row.get("loss") for row in again] == [row.get("loss") for row in straight]


def test_a_finished_training_is_only_read(tmp_path: Path) -> None:
    first = network()
    train(first, Line(), SETTINGS, tmp_path)
    other = network()
    assert len(train(other, Line(stop_after=0), SETTINGS, tmp_path)) == 7
    for name, value in first.state_dict().items():
        assert torch.equal(value, other.state_dict()[name])


def test_other_settings_are_refused(tmp_path: Path) -> None:
    train(network(), Line(), SETTINGS, tmp_path)
    with pytest.raises(InputError, match="another settings"):
        train(network(), Line(), replace(SETTINGS, learning_rate=1e-3), tmp_path)


def test_a_damaged_checkpoint_is_told(tmp_path: Path) -> None:
    train(network(), Line(), SETTINGS, tmp_path)
    file = tmp_path / FILE
    file.write_bytes(file.read_bytes()[:-7])
    with pytest.raises(InputError, match="not readable"):
        train(network(), Line(), SETTINGS, tmp_path)


def test_checkpoints_are_no_pickles(tmp_path: Path) -> None:
    train(network(), Line(), SETTINGS, tmp_path)
    tensors, told = read_tensors(tmp_path / FILE)
    assert {name.split(".")[0] for name in tensors} == {"model", "step", "exp_avg", "exp_avg_sq"}
    assert told["epochs"] == 6


def test_a_loss_that_is_not_finite_ends_it_and_keeps_what_was(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="learning_rate"):
        train(network(), Line(poison=True), SETTINGS, tmp_path)
    assert not (tmp_path / FILE).exists()


def test_bf16_learns_too(tmp_path: Path) -> None:
    history = train(network(), Line(), replace(SETTINGS, precision="bf16"), tmp_path)
    assert history[-1]["loss"] < 0.5 * history[1]["loss"]


def test_the_rate_rises_in_a_line_and_falls_as_a_cosine() -> None:
    assert [rate(done, 0.2) for done in (0.0, 0.1, 0.2)] == pytest.approx([0.0, 0.5, 1.0])
    assert rate(0.6, 0.2) == pytest.approx(0.5)
    assert rate(1.0, 0.2) == pytest.approx(0.0)
    assert rate(0.5, 0.0) == pytest.approx(0.5 * (1.0 + math.cos(0.5 * math.pi)))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"epochs": 0}, "epochs = 0"),
        ({"learning_rate": -1.0}, "learning_rate"),
        ({"warm_up": 1.0}, "warm_up"),
        ({"precision": "fp8"}, "precision"),
        ({"clip": 0.0}, "clip"),
    ],
)
def test_settings_that_cannot_be_are_told(change: dict, says: str) -> None:
    with pytest.raises(InputError, match=says):
        replace(SETTINGS, **change)
