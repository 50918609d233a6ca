"""Every file of scenes/ at reduced size: what it expects must hold, and so must a verification of its own.

Reduced means coarse triangles, a time step a frame, three frames of motion, a drape that settles
for a few steps only, the first and last shape of a sweep; the stress set goes on until the worst
is over, on triangles so coarse that each takes seconds. Expectations are the file's own, but for three:
`frames` becomes the number of frames of the shortened motion. `residual` and `at_rest` tell of cloth that was
given the time to come to rest: they are asked where the whole time was given, over a sphere. A dataset's
expectations hold for each of its samples. The robustness set is only planned: it is hours of work.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from muslin.sim.body.load import ASSETS, load_body
from muslin.sim.dataset.config import DatasetConfig, load_config
from muslin.sim.dataset.plan import plan
from muslin.sim.dataset.sample import Sample
from muslin.sim.dataset.verify import verify_sample
from muslin.sim.expect import check_expectations
from muslin.sim.motion import load_motion, motion_names, write_amass
from muslin.sim.run import simulate_chain
from muslin.sim.scene import ExpectTable, Scene, load_scene, parse_scene
from muslin.sim.setting import cut_garment

FOLDER = Path(__file__).resolve().parents[2] / "scenes"
ROBUSTNESS = FOLDER / "robustness.toml"
SCENES = sorted(path for path in FOLDER.glob("*.toml") if path != ROBUSTNESS)
STRESS = {"ring": (0.036, 2.0), "spikes": (0.035, 2.0), "stack": (0.12, 0.8), "twist": (0.03, 10.0)}
"""Scenes of the stress set: edge length, metres, and seconds that they are reduced to."""

EDGE_LENGTH = 0.065
SECONDS = 0.07
SETTLE_STEPS = 6
TIME_STEP = 0.034  # one step a frame of 30 a second
USERS_OWN = "user_smpl_amass"


def test_there_are_scenes() -> None:
    assert {path.stem for path in SCENES} >= {
        "cloth_on_sphere",
        "demo",
        "dress_dance",
        "shirt_under_dress",
        "tshirt_walk",
        USERS_OWN,
    }
    assert {path.stem for path in (FOLDER / "stress").glob("*.toml")} == set(STRESS)


@pytest.mark.parametrize("name", STRESS)
def test_stress_scene_ends_without_an_intersection(name: str) -> None:
    path = FOLDER / "stress" / f"{name}.toml"
    layers = len(load_scene(path).layers)
    keys = ["garment.edge_length", *(f"layers.{k}.edge_length" for k in range(layers))]
    edge_length, seconds = STRESS[name]
    overrides = [f"{key}={edge_length}" for key in keys]
    overrides += [f"solver.dt={TIME_STEP}", "sequence.fps=10", f"sequence.duration={seconds}"]
    full = load_scene(path, overrides)
    assert full.sequence is not None
    frames = {"frames": round(full.sequence.duration * full.sequence.fps) + 1}
    scene = full.model_copy(update={"expect": full.expect.model_copy(update=frames)})
    (sample,) = simulate_chain([scene])
    assert check_expectations(scene, sample) == []
    finding = verify_sample(sample.validate())
    assert finding.reason == ""
    assert (finding.cloth_cloth, finding.cloth_body, finding.frames) == (0, 0, sample.num_frames)


def test_the_stress_scenes_do_what_they_are_named_for() -> None:
    ring, twist = (load_scene(FOLDER / "stress" / f"{name}.toml") for name in ("ring", "twist"))
    assert ring.sequence is not None
    pulled = np.array(ring.pins[0].velocity) * ring.sequence.duration
    assert -pulled[1] > 0.5 * 0.5 * np.sqrt(2.0) + 0.1, "farther than from the middle to a corner"
    turns = np.linalg.norm(twist.pins[1].spin) * twist.pins[1].stop / (2.0 * np.pi)
    assert turns == pytest.approx(10.0)


def test_the_robustness_set_is_every_clip_on_every_combination() -> None:
    jobs = plan(load_config(ROBUSTNESS)).jobs
    scenes = [parse_scene(job.scene) for job in jobs]
    clips = [scene.motion for scene in scenes if scene.motion is not None]
    betas = {tuple(scene.body.beta) for scene in scenes if scene.body is not None}
    assert len(jobs) == len(clips) == len(motion_names()) * 2 * 2 * 3
    assert {clip.clip for clip in clips} == set(motion_names())
    assert {(clip.start, clip.end, clip.fps) for clip in clips} == {(0.0, None, 30.0)}
    assert len({scene.fabric for scene in scenes}) == 2
    assert betas == {(-3.0, 0.0), (0.0, 0.0), (3.0, 0.0)}
    for design in ("tshirt", "long_dress"):
        first = next(parse_scene(job.scene) for job in jobs if job.labels["design"] == design)
        assert 700 <= cut_garment(first).num_vertices <= 1000


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_scene_keeps_what_it_expects(path: Path, tmp_path: Path) -> None:
    with path.open("rb") as file:
        is_dataset = "kind" in tomllib.load(file)
    chains = reduced_dataset(path) if is_dataset else [[reduced_scene(path, tmp_path)]]
    for scenes in chains:
        samples = list(simulate_chain(scenes))
        assert len(samples) == len(scenes)
        for scene, sample in zip(scenes, samples, strict=True):
            assert check_expectations(scene, sample) == []
            finding = verify_sample(sample.validate())
            assert finding.reason == ""
            assert (finding.cloth_cloth, finding.cloth_body) == (0, 0)
            assert finding.frames == sample.num_frames
            assert_worn(sample)


def reduced_scene(path: Path, folder: Path) -> Scene:
    overrides = [f"garment.edge_length={EDGE_LENGTH}", f"solver.dt={TIME_STEP}"]
    full = load_scene(path)
    overrides += [f"layers.{k}.edge_length={EDGE_LENGTH}" for k in range(len(full.layers))]
    if full.motion is not None:
        overrides += [f"motion.end={full.motion.start + SECONDS}"]
    if full.body is not None:
        overrides += [f"solver.settle_steps={SETTLE_STEPS}"]
    if path.stem == USERS_OWN:
        body, motion = folder / "body.npz", folder / "motion_poses.npz"
        write_smpl_body(body)
        write_amass(motion, load_motion("walk"))
        overrides += [f"body.model={body}", f"motion.clip={motion}"]
    return reduced_expectations(load_scene(path, overrides))


def reduced_dataset(path: Path) -> list[list[Scene]]:
    """The chains of a dataset with the two ends of each sweep of shapes, and its clips shortened."""
    full = load_config(path)
    overrides = [f"scene.garment.edge_length={EDGE_LENGTH}", f"scene.solver.settle_steps={SETTLE_STEPS}"]
    overrides += [f"scene.solver.dt={TIME_STEP}"]
    sweeps = [k for k, shape in enumerate(full.shapes) if shape.sweep is not None]
    overrides += [f"shapes.{k}.sweep.count=2" for k in sweeps]
    overrides += [f"sequences.{k}.end={clip.start + SECONDS}" for k, clip in enumerate(full.sequences)]
    config: DatasetConfig = load_config(path, overrides)
    expect = ExpectTable.model_validate(config.expect)
    return [
        [
            reduced_expectations(parse_scene(job.scene).model_copy(update={"expect": expect}))
            for job in chain.jobs
        ]
        for chain in plan(config).chains
    ]


def reduced_expectations(scene: Scene) -> Scene:
    if scene.body is None:
        return scene
    changes: dict[str, int | None] = {"residual": None, "at_rest": None, "frames": 1}
    if scene.motion is not None:
        changes["frames"] = round(SECONDS * scene.motion.fps) + 1
    return scene.model_copy(update={"expect": scene.expect.model_copy(update=changes)})


def assert_worn(sample: Sample) -> None:
    """The garment is where the collider is, in every frame, and not below its feet."""
    for frame in range(sample.num_frames):
        cloth, body = sample.positions[frame], sample.body_vertices(frame)
        assert np.linalg.norm(cloth.mean(axis=0) - body.mean(axis=0)) < 0.5
        if sample.body is not None:
            assert cloth[:, 1].min() > body[:, 1].min()


def write_smpl_body(path: Path) -> None:
    """The default female body as an SMPL .npz: SMPL's keys and types, joints regressed from the skin."""
    model = load_body("female")
    with np.load(ASSETS / "female.npz") as asset:
        regressor = asset["J_regressor"].astype(np.float64)
    parents = model.parents.astype(np.int64)
    parents[0] = 4294967295
    np.savez(
        path,
        v_template=model.v_template,
        shapedirs=model.shapedirs,
        posedirs=model.posedirs,
        J_regressor=regressor,
        weights=model.weights,
        kintree_table=np.stack([parents, np.arange(24)]),
        f=model.faces.astype(np.uint32),
    )
