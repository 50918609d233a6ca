"""The smallest preset of thesis_static: made, verified, learned from, predicted and scored."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from typer.testing import CliRunner

from muslin.eval.cli.app import app
from muslin.garments.errors import InputError
from muslin.learn.drape.baselines import NearestDrape, SkinnedMean, baseline_of
from muslin.learn.drape.collisions import collision_loss
from muslin.learn.drape.dense import dense_drapes
from muslin.learn.drape.examples import mean_drapes, read_examples
from muslin.learn.drape.fine_tune import FineTuning, fine_tune
from muslin.learn.drape.fully_connected import load_dense, train_fully_connected, train_single_garment
from muslin.learn.drape.pipeline import ANY_FABRIC, DrapePipeline, load_pipeline
from muslin.learn.drape.predict import SHIPPED, garment_of, load_draper, predict_dataset, predict_one
from muslin.learn.drape.push_out import PushedOut
from muslin.learn.drape.smoothing import LENGTH, Smoother
from muslin.learn.drape.train import DrapeSettings, train_pipeline
from muslin.learn.drape.world import Draper, in_body_frame
from muslin.learn.training.loop import Settings
from muslin.sim.dataset.config import load_config
from muslin.sim.dataset.generate import generate
from muslin.sim.dataset.reader import Dataset, open_dataset
from muslin.sim.dataset.sample import Sample
from muslin.sim.dataset.verify import verify_sample

STATIC = Path(__file__).parents[2] / "scenes/datasets/thesis_static.toml"
SHORT = Settings(epochs=60, learning_rate=3e-3)
SETTINGS = DrapeSettings(smooth=SHORT, fine=SHORT, channels=(16, 32, 64, 64), batch=4)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("tiny")


@pytest.fixture(scope="module")
def dataset(folder: Path) -> Dataset:
    report = generate(load_config(STATIC, preset="tiny"), folder / "data", workers=2)
    assert not report.failed
    return open_dataset(folder / "data")


@pytest.fixture(scope="module")
def pipeline(dataset: Dataset, folder: Path) -> DrapePipeline:
    return train_pipeline(dataset, folder / "model", SETTINGS)


def errors(draper: Draper, dataset: Dataset) -> np.ndarray:
    """Mean vertex error of each sample, metres."""
    found = []
    for sample in dataset:
        assert sample.body is not None
        (drape,) = draper.drapes([draper.prepare(sample.garment)], [sample.body.beta], [sample.fabric])
        found.append(np.linalg.norm(drape.numpy() - in_body_frame(sample), axis=1).mean())
    return np.array(found)


def test_it_is_made_and_verified(dataset: Dataset) -> None:
    assert len(dataset) == 27
    meshes: dict[tuple[str, str], bytes] = {}
    for row in dataset.rows:
        sample = dataset[row["id"]]
        assert verify_sample(sample).reason == ""
        faces = sample.garment.faces.tobytes()
        assert meshes.setdefault((row["design"], row["topology"]), faces) == faces


def test_garments_are_around_the_body_that_they_are_bound_to(
    pipeline: DrapePipeline, dataset: Dataset
) -> None:
    for sample in dataset.split("train"):
        assert sample.body is not None
        points = in_body_frame(sample)
        distances, *_ = pipeline.body.nearest(points, sample.body.beta)
        assert 0.0 < distances.min() < 0.005
        garment = pipeline.prepare(sample.garment)
        assert float((garment.skinned(sample.body.beta) - torch.from_numpy(points)).norm(dim=1).mean()) < 0.05


def test_examples_hold_what_the_samples_hold(dataset: Dataset) -> None:
    examples = read_examples(dataset.split("train"))
    assert (len(examples.examples), len(examples.garments), examples.betas) == (8, 4, 1)
    assert examples.parameters == ("sleeve_length", "chest_circumference", "garment_length")
    for example in examples.examples:
        smooth = Smoother(examples.garments[example.garment], LENGTH)(example.average.numpy())
        for fabric, drape in example.drapes.items():
            assert np.array_equal(drape.numpy(), in_body_frame(dataset[example.ids[fabric]]))
            assert 1e-4 < np.linalg.norm(drape.numpy() - smooth, axis=1).mean() < 0.02


def test_mean_drapes_lie_on_the_drapes_they_are_of(dataset: Dataset) -> None:
    examples = read_examples(dataset.split("train"))
    parameters, drapes = mean_drapes(examples)
    assert parameters.shape == (2, 3)
    source = [e for e in examples.examples if examples.garments[e.garment].num_vertices == len(drapes[0])]
    for values, drape in zip(parameters, drapes, strict=True):
        own = [
            e.drapes["gray-interlock"]
            for e in source
            if examples.garments[e.garment].parameters["garment_length"] == pytest.approx(float(values[2]))
        ]
        assert len(own) == 2
        torch.testing.assert_close(drape, torch.stack(own).mean(0), atol=1e-5, rtol=0.0)


def test_the_pipeline_beats_the_mean_drape_and_the_nearest_one(
    pipeline: DrapePipeline, dataset: Dataset
) -> None:
    assert errors(pipeline, dataset.split("train")).mean() < 0.008
    mean = SkinnedMean(pipeline)
    for split, most in (("train", 0.6), ("test-topologies", 0.8), ("test-designs", 1.0)):
        part = dataset.split(split)
        assert errors(pipeline, part).mean() < most * errors(mean, part).mean()
    # Of seen designs it has the drapes themselves.
    nearest = NearestDrape(dense_drapes(read_examples(dataset.split("train"))))
    unseen = dataset.split("test-designs")
    assert errors(pipeline, unseen).mean() < 0.8 * errors(nearest, unseen).mean()


def test_fine_is_nearer_than_smooth_on_what_was_learned(pipeline: DrapePipeline, dataset: Dataset) -> None:
    fine, smooth = [], []
    for sample in dataset.split("train"):
        assert sample.body is not None
        garment = pipeline.prepare(sample.garment)
        truth = torch.from_numpy(in_body_frame(sample))
        (said,) = pipeline.smooth_drapes([garment], [sample.body.beta])
        (all_of_it,) = pipeline.drapes([garment], [sample.body.beta], [sample.fabric])
        smooth.append(float((said - truth).norm(dim=1).mean()))
        fine.append(float((all_of_it - truth).norm(dim=1).mean()))
    assert np.mean(fine) < 0.9 * np.mean(smooth)


def test_what_is_stored_says_the_same(pipeline: DrapePipeline, dataset: Dataset, folder: Path) -> None:
    loaded = load_pipeline(folder / "model", folder / "model" / "graphs")
    part = dataset.split("test-designs")
    assert np.array_equal(errors(loaded, part), errors(pipeline, part))
    pipeline.save(folder / "half", torch.bfloat16)
    np.testing.assert_allclose(
        errors(load_pipeline(folder / "half"), part), errors(pipeline, part), atol=2e-3
    )


def test_training_again_only_reads(pipeline: DrapePipeline, dataset: Dataset, folder: Path) -> None:
    again = train_pipeline(dataset, folder / "model", SETTINGS)
    for name, value in pipeline.smooth.state_dict().items():
        assert torch.equal(value, again.smooth.state_dict()[name])


def test_one_network_for_all_fabrics(dataset: Dataset, folder: Path) -> None:
    few = Settings(epochs=2, learning_rate=3e-3)
    settings = DrapeSettings(few, few, channels=(8, 8, 8, 8), batch=4, fabric_input=True)
    made = train_pipeline(dataset, folder / "any", settings)
    assert list(made.fine) == [ANY_FABRIC]
    sample = dataset[0]
    assert sample.body is not None
    garment = made.prepare(sample.garment)
    one, other = (
        made.drapes([garment], [sample.body.beta], [name])[0]
        for name in ("gray-interlock", "11oz-black-denim")
    )
    assert not torch.equal(one, other)


def test_fine_tuning_takes_cloth_out_of_the_body(
    pipeline: DrapePipeline, dataset: Dataset, folder: Path
) -> None:
    before, own = (load_pipeline(folder / "model", folder / "model" / "graphs") for _ in range(2))
    for pressed in (before, own):
        with torch.no_grad():  # some millimetres down, into the shoulders
            pressed.fine["gray-interlock"].unet.last.bias[1] -= 1.0
    examples = read_examples(dataset.split("train"))
    options = FineTuning(Settings(epochs=4, learning_rate=3e-3), garments=6, steps=8, batch=3, anchor=0.0)
    tuned = fine_tune(own, examples, folder / "tuned", options)
    log = (folder / "tuned/train/collisions-gray-interlock/history.jsonl").read_text().splitlines()
    rows = [json.loads(line) for line in log]
    assert rows[-1]["train_inside"] < 0.7 * rows[0]["train_inside"]
    assert rows[-1]["loss"] < rows[1]["loss"]
    assert max(_collisions(before, sample) for sample in dataset) > 0.01
    loss = {
        name: np.mean([_collisions(draper, sample) for sample in dataset])
        for name, draper in (("before", before), ("after", tuned))
    }
    assert loss["after"] < 0.7 * loss["before"]


def _collisions(pipeline: DrapePipeline, sample: Sample) -> float:
    assert sample.body is not None
    beta = torch.tensor(sample.body.beta)
    (drape,) = pipeline.drapes([pipeline.prepare(sample.garment)], [beta], [sample.fabric])
    return float(collision_loss(drape, beta, pipeline.body))


def test_rivals_learn_are_stored_and_know_their_limits(dataset: Dataset, folder: Path) -> None:
    drapes = dense_drapes(read_examples(dataset.split("train")))
    settings = Settings(epochs=200, learning_rate=1e-3)
    train = dataset.split("train")
    full = train_fully_connected(drapes, folder / "fc", settings)
    assert errors(full, train).mean() < 0.01
    assert np.array_equal(errors(load_dense(folder / "fc"), train), errors(full, train))
    seen = {name: float(value) for name, value in zip(drapes.names, drapes.parameters[0], strict=True)}
    single = train_single_garment(drapes, seen, folder / "ssch", Settings(epochs=500, learning_rate=1e-2))
    design = train.rows[0]["design"]
    assert errors(single, train.where(design=design)).mean() < 0.01
    with pytest.raises(InputError, match="knows"):
        errors(single, dataset.split("test-designs"))


def test_predictions_are_a_dataset_that_can_be_scored(
    pipeline: DrapePipeline, dataset: Dataset, folder: Path
) -> None:
    part = dataset.split("test-designs")
    made = predict_dataset(pipeline, part, folder / "predicted", batch=4)
    assert made.ids == part.ids
    sample, truth = made[0], part[0]
    assert np.array_equal(sample.garment.faces, truth.garment.faces)
    assert sample.labels == truth.labels
    assert sample.certificate.cloth_body_intersections is None
    run = CliRunner().invoke(
        app, ["eval", str(folder / "predicted"), str(folder / "data"), "--metrics", "vertex", "--json",
              str(folder / "scores.json")]
    )  # fmt: skip
    assert run.exit_code == 0, run.output
    scores = json.loads((folder / "scores.json").read_text())
    expected = 1e3 * errors(pipeline, part).mean()
    assert f"{expected:.2f}"[:4] in json.dumps(scores)


def test_the_command_line_trains_and_predicts(dataset: Dataset, folder: Path) -> None:
    data, model = str(folder / "data"), str(folder / "by-command")
    done = CliRunner().invoke(app, ["train", "drape", "--dataset", data, "--out", model, "--epochs", "1"])
    assert done.exit_code == 0, done.output
    assert "2 networks" in done.output
    out = folder / "tee.obj"
    asked = ["--design", "sleeve_length=0.3", "--design", "chest_circumference=1.0", "--design",
             "garment_length=0.6", "--beta", "0.5", "--target-area", "1e-3"]  # fmt: skip
    drape = CliRunner().invoke(app, ["predict", model, *asked, "--out", str(out)])
    assert drape.exit_code == 0, drape.output
    assert out.exists()
    again = CliRunner().invoke(app, ["predict", model, *asked, "--out", str(out)])
    assert again.exit_code == 2
    wrong = CliRunner().invoke(app, ["predict", data, *asked, "--out", str(folder / "b.obj")])
    assert wrong.exit_code == 2

    apart = folder / "by-stages"
    run("train", "smooth", "--dataset", data, "--out", str(apart), "--epochs", "1")
    assert not load_pipeline(apart).fine
    run("train", "fine", "--dataset", data, "--out", str(apart), "--epochs", "1")
    for file in ("mean.safetensors", "smooth.safetensors", "fine/gray-interlock.safetensors"):
        assert (apart / file).read_bytes() == (Path(model) / file).read_bytes()
    few = ["--dataset", data, "--epochs", "1"]
    run("train", "collisions", model, "--garments", "2", *few, "--out", str(folder / "c"))
    run("train", "fc", *few, "--out", str(folder / "f"))
    run(
        "train",
        "ssch",
        "--design",
        dataset.split("train").rows[0]["design"],
        *few,
        "--out",
        str(folder / "s"),
    )
    for made in ("c", "f", "s"):
        assert load_draper(folder / made).world == load_draper(Path(model)).world


def test_without_fine_networks_drapes_stay_smooth(pipeline: DrapePipeline, dataset: Dataset) -> None:
    smooth = replace(pipeline, fine={})
    sample = dataset[0]
    assert sample.body is not None
    ask = [smooth.prepare(sample.garment)], [sample.body.beta]
    assert torch.equal(smooth.drapes(*ask, [sample.fabric])[0], pipeline.smooth_drapes(*ask)[0])


def test_baselines_are_predicted_by_command(pipeline: DrapePipeline, dataset: Dataset, folder: Path) -> None:
    known = dense_drapes(read_examples(dataset.split("train")))
    drapers = {"mean-on-skin": SkinnedMean(pipeline), "nearest": NearestDrape(known)}
    for kind, draper in drapers.items():
        part = dataset.split("test-designs")
        run("predict", str(folder / "model"), "--dataset", str(folder / "data"), "--split", "test-designs",
            "--baseline", kind, "--out", str(folder / kind))  # fmt: skip
        told = open_dataset(folder / kind)
        apart = predict_dataset(draper, part, folder / f"{kind}-apart")
        assert all(np.array_equal(told[i].positions, apart[i].positions) for i in part.ids)
    with pytest.raises(InputError, match="mean-on-skin and nearest"):
        baseline_of(pipeline, "farthest", dataset)


def test_what_is_pushed_out_is_outside_and_nearly_where_it_was(
    pipeline: DrapePipeline, dataset: Dataset
) -> None:
    pushed = PushedOut(pipeline)
    for sample in dataset.split("test-designs"):
        assert sample.body is not None
        ask = [sample.body.beta], [sample.fabric]
        (said,) = pipeline.drapes([pipeline.prepare(sample.garment)], *ask)
        (outside,) = pushed.drapes([pushed.prepare(sample.garment)], *ask)
        distances, *_ = pipeline.body.nearest(outside.numpy(), sample.body.beta)
        assert (distances > -1e-6).all()
        assert float((outside - said).norm(dim=1).mean()) < 1e-3


def test_the_shipped_networks_drape(dataset: Dataset, folder: Path) -> None:
    shipped = load_draper(SHIPPED)
    assert shipped.world.fabrics == ("gray-interlock", "white-dots-on-blk")
    files = [file for file in SHIPPED.rglob("*") if file.is_file()]
    assert sum(file.stat().st_size for file in files) < 8e6
    # These drapes are of 404 vertices, stiffer than any that it learned from.
    assert errors(shipped, dataset.split("test-designs")).mean() < 0.016
    out = folder / "shipped.obj"
    run("predict", "--design", "garment_length=0.8", "--beta", "1", "--out", str(out))
    assert out.exists()


def run(*command: str) -> None:
    done = CliRunner().invoke(app, [*command])
    assert done.exit_code == 0, done.output


def test_any_triangulation_is_draped(pipeline: DrapePipeline) -> None:
    parameters = {"sleeve_length": 0.2, "chest_circumference": 1.04, "garment_length": 0.6}
    heights = []
    for mesh in (garment_of("tee", parameters, 1e-3, seed) for seed in (0, 1)):
        sample = predict_one(pipeline, mesh, [0.5], "gray-interlock")
        assert sample.positions.shape == (1, mesh.num_vertices, 3)
        heights.append(float(np.ptp(sample.positions[0, :, 1])))
    assert heights[0] == pytest.approx(heights[1], abs=0.02)
    with pytest.raises(InputError, match="denim"):
        predict_one(pipeline, mesh, [0.5], "11oz-black-denim")
    with pytest.raises(InputError, match="beta"):
        predict_one(pipeline, mesh, [float("nan")], "gray-interlock")


@pytest.fixture(autouse=True)
def _one_thread() -> Iterator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)
