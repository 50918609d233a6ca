"""The loss curve of a training, as a picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from matplotlib.figure import Figure


def draw_curve(history: Sequence[Mapping[str, float]], file: Path) -> None:
    """Loss over epochs in logarithmic scale, and below it every other figure.

    history: a row an epoch, of which the first may have no loss.
    """
    keys = [key for key in history[-1] if key not in ("epoch", "seconds", "loss")]
    epochs = [row["epoch"] for row in history]
    figure = Figure(figsize=(7.0, 3.0 if not keys else 5.5), layout="constrained")
    axes = figure.subplots(2 if keys else 1, 1, sharex=True, squeeze=False)[:, 0]
    axes[0].semilogy(epochs, [row.get("loss", float("nan")) for row in history], color="black", label="loss")
    axes[0].set_ylabel("loss")
    for key in keys:
        axes[-1].plot(epochs, [row[key] for row in history], label=key)
    if keys:
        axes[-1].legend(frameon=False)
        axes[-1].set_ylim(bottom=0.0)
    axes[-1].set_xlabel("epoch")
    for axis in axes:
        axis.grid(alpha=0.3)
        axis.spines[["top", "right"]].set_visible(False)
    figure.savefig(file, dpi=110)
