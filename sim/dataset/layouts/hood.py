"""The form of HOOD and ContourCraft: sequences of meshes, motions, garment dictionaries.

    samples/ID/sequence.pkl      pred (T, V, 3), cloth_faces, obstacle (T, N, 3), obstacle_faces: a rollout,
                                 as HOOD's `utils/show.py` shows it; obstacle once more as verts and faces,
                                 the mesh sequence of `datasets/from_any_pose.py` (pose_sequence_type "mesh")
    samples/ID/cloth.obj         the garment in the first frame: the template for the same
    motions/ID.npz               betas, poses (T, 72), trans, mocap_framerate: AMASS's names, read by
                                 `datasets/sequence_loaders/cmu_npz_smpl.py`
    aux_data/garments/NAME.pkl   one garment: rest_pos, faces, node_type, lbs (v, f, shapedirs, posedirs,
                                 lbs_weights), gender, model_type (ContourCraft's garment_dicts_dir)
    aux_data/garments.pkl        all of them by name (HOOD's garment_dict_file)
    aux_data/splits/SPLIT.csv    id, length, garment of the samples of a split

Pickles are written where those programs read nothing else, and hold dictionaries of NumPy arrays, text and
nothing that is run. Motions and garment dictionaries are written where the body has SMPL's form; they fit the
body model of the dataset alone, so HOOD has to be given the same file. HOOD straightens the hands of motions
that it reads.

`lbs.v` is the garment in the first sample that wears it, brought to the T-pose and to beta = 0 by inverse
skinning, so that HOOD's skinning of it in that pose gives those positions back. `rest_pos` is the same: HOOD
takes rest lengths from it, so from a drape, not from the pattern; that is in `panel_vertices` (P, 2) and
`panel_faces`, keys of ours. Coarse edges are left to HOOD's `add_coarse_edges`, which makes those that are
missing.

Sources: Grigorev et al. (2023), "HOOD", and (2024), "ContourCraft", and the loaders of their repositories.
"""

from __future__ import annotations

import csv
import hashlib
import io
import pickle
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from muslin.garments.mesh import GarmentMesh
from muslin.sim.body.load import BODY_NAMES
from muslin.sim.body.skinning import bind, unpose
from muslin.sim.dataset import durable
from muslin.sim.dataset.export import write_obj
from muslin.sim.dataset.layouts.layout import Facts, Layout
from muslin.sim.dataset.parts import Part, sample_parts
from muslin.sim.dataset.reader import Dataset
from muslin.sim.dataset.sample import BodyTrack, Sample, body_model

HOOD_FPS = 30.0


def _write(sample: Sample, folder: Path, out: Path, body: bool) -> Facts:
    cloth, *others = sample_parts(sample, body)
    assert isinstance(cloth, Part)  # samples of changing topology are not given to this layout
    arrays = {"pred": cloth.positions, "cloth_faces": cloth.faces.astype(np.int64)}
    for part in others:
        assert isinstance(part, Part)
        faces = part.faces.astype(np.int64)
        # The pickle holds an array that is named twice but once.
        arrays |= {
            "obstacle": part.positions,
            "obstacle_faces": faces,
            "verts": part.positions,
            "faces": faces,
        }
    (folder / "sequence.pkl").write_bytes(pickle.dumps(arrays, protocol=4))
    write_obj(folder / "cloth.obj", cloth.at(0))
    if sample.body is not None:
        durable.make_folder(out / "motions")
        durable.write_file(out / "motions" / f"{sample.id}.npz", _motion(sample.body, sample.fps))
    return {"garment": garment_key(sample.garment)}


def garment_key(mesh: GarmentMesh) -> str:
    """A name that tells designs and topologies apart: that of the garment, and a digest of its triangles."""
    digest = hashlib.sha256(mesh.faces.tobytes() + mesh.panel_vertices.tobytes()).hexdigest()
    return f"{re.sub(r'[^A-Za-z0-9-]', '_', mesh.name)}_{digest[:8]}"


def garment_dict(mesh: GarmentMesh, positions: np.ndarray, track: BodyTrack) -> dict[str, Any]:
    """What HOOD knows of a garment, from positions (V, 3) in the first frame of a body.

    Raises InputError if the pose folds the skin where the garment lies, so that it cannot be undone.
    """
    model = body_model(track)
    pose = track.beta, track.poses[0], track.translations[0]
    binding = bind(positions, model, *pose)
    shapedirs, posedirs = binding.interpolate(model.shapedirs), binding.interpolate(model.posedirs)
    v = unpose(positions, binding, *pose) - shapedirs[..., : len(track.beta)] @ track.beta
    faces = mesh.faces.astype(np.int64)
    lbs = {
        "v": v,
        "f": faces,
        "shapedirs": shapedirs,
        "posedirs": posedirs.transpose(2, 0, 1).reshape(posedirs.shape[2], -1),
        "lbs_weights": binding.weights,
    }
    return {
        "rest_pos": v.astype(np.float32),
        "faces": faces,
        "node_type": np.zeros((len(v), 1), dtype=np.int64),
        "lbs": {
            key: array if array.dtype.kind == "i" else array.astype(np.float32) for key, array in lbs.items()
        },
        "gender": next((name for name in BODY_NAMES if name in Path(track.model).stem.lower()), "neutral"),
        "model_type": "smpl",
        "panel_vertices": mesh.panel_vertices,
        "panel_faces": mesh.panel_faces,
    }


def _finish(dataset: Dataset, facts: Sequence[Mapping[str, Any]], out: Path) -> None:
    first = {entry["garment"]: entry["id"] for entry in reversed(facts) if entry["body"]}
    garments = {}
    for folder in ("aux_data/garments", "aux_data/splits"):
        durable.make_folder(out / folder)
    for name, sample_id in sorted(first.items()):
        sample = dataset[sample_id]
        assert sample.body is not None
        garments[name] = garment_dict(sample.garment, sample.positions[0], sample.body)
        durable.write_file(
            out / "aux_data/garments" / f"{name}.pkl", pickle.dumps(garments[name], protocol=4)
        )
    if garments:
        durable.write_file(out / "aux_data/garments.pkl", pickle.dumps(garments, protocol=4))
    for split in dict.fromkeys(entry["split"] for entry in facts):
        table = io.StringIO()
        rows = csv.writer(table, lineterminator="\n")
        rows.writerow(["id", "length", "garment"])
        rows.writerows([e["id"], e["frames"], e["garment"]] for e in facts if e["split"] == split)
        durable.write_file(out / "aux_data/splits" / f"{split or 'all'}.csv", table.getvalue().encode())


def _motion(track: BodyTrack, fps: float | None) -> bytes:
    data = io.BytesIO()
    np.savez(
        data,
        betas=track.beta,
        poses=track.poses.reshape(-1, 72),
        trans=track.translations,
        mocap_framerate=np.array(fps or HOOD_FPS),
    )
    return data.getvalue()


HOOD = Layout(_write, _finish)
