"""The smallest preset of thesis_animated: made, verified, learned from, predicted and scored."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from muslin.eval.cli.app import app
from muslin.garments.errors import InputError
from muslin.learn.training.loop import Settings
from muslin.learn.wrinkles.baselines import baseline_of
from muslin.learn.wrinkles.model import WrinkleModel, load_wrinkles
from muslin.learn.wrinkles.predict import Animator, predict_sequences
from muslin.learn.wrinkles.process import Drawing
from muslin.learn.wrinkles.train import WrinkleSettings, train_wrinkles
from muslin.sim.dataset.config import load_config
from muslin.sim.dataset.generate import generate
from muslin.sim.dataset.reader import Dataset, open_dataset
from muslin.sim.dataset.verify import verify_sample

ANIMATED = Path(__file__).parents[2] / "scenes/datasets/thesis_animated.toml"
SHORT = Settings(epochs=60, learning_rate=2e-3)
SMALLEST = WrinkleSettings(SHORT, network="tiny", size=64, batch=10)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("animated")


@pytest.fixture(scope="module")
def dataset(folder: Path) -> Dataset:
    report = generate(load_config(ANIMATED, preset="tiny"), folder / "data", workers=2)
    assert not report.failed
    return open_dataset(folder / "data")


@pytest.fixture(scope="module")
def temporal(dataset: Dataset, folder: Path) -> WrinkleModel:
    return train_wrinkles(dataset, folder / "temporal", SMALLEST)


@pytest.fixture(scope="module")
def regression(dataset: Dataset, folder: Path) -> WrinkleModel:
    settings = replace(SMALLEST, temporal=False, process="regression")
    return train_wrinkles(dataset, folder / "regression", settings)


def vertex_error(animator: Animator, truth: Dataset, out: Path) -> float:
    """Mean distance of vertices, metres."""
    predicted = predict_sequences(animator, truth, out)
    wrong = [np.linalg.norm(predicted[id].positions - truth[id].positions, axis=-1) for id in truth.ids]
    return float(np.mean([own.mean() for own in wrong]))


def test_it_is_made_and_verified(dataset: Dataset) -> None:
    assert len(dataset) == 4
    meshes: dict[str, bytes] = {}
    for row in dataset.rows:
        sample = dataset[row["id"]]
        assert verify_sample(sample).reason == ""
        faces = sample.garment.faces.tobytes()
        assert meshes.setdefault(row["design"], faces) == faces
    modes = {row["sequence"]: dataset[row["id"]].scene["motion"]["mode"] for row in dataset.rows}
    assert modes == {"walk": "dynamic", "held-kick": "quasi-static"}


def test_networks_beat_what_is_trivial(
    temporal: WrinkleModel, regression: WrinkleModel, dataset: Dataset, tmp_path: Path
) -> None:
    """On a design that was not seen, in the motion that was."""
    unseen = dataset.split("test-designs")
    template = vertex_error(baseline_of(temporal, "template-on-skin", dataset), unseen, tmp_path / "template")
    nearest = vertex_error(baseline_of(temporal, "nearest", dataset), unseen, tmp_path / "nearest")
    one_step = vertex_error(regression, unseen, tmp_path / "regression")
    drawn = vertex_error(temporal, unseen, tmp_path / "drawn")
    print(template, nearest, one_step, drawn)
    assert one_step < 0.7 * min(template, nearest)
    assert drawn < 0.7 * min(template, nearest)
