"""Bodies by name or from a user's SMPL file."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.sim.body.joints import NUM_JOINTS, NUM_POSE_FEATURES
from muslin.sim.body.model import BodyModel
from muslin.sim.body.smpl_npz import read_npz
from muslin.sim.body.smpl_pickle import read_pickle

ASSETS = Path(__file__).parent / "assets"
BODY_NAMES = ("female", "male", "neutral")
REQUIRED = ("v_template", "shapedirs", "posedirs", "weights", "kintree_table", "f")
OPTIONAL = (
    "J_regressor", "joint_template", "joint_shapedirs", "shapedirs_scale", "posedirs_scale", "weights_scale",
    "source",
)  # fmt: skip
READERS = {".npz": read_npz, ".pkl": read_pickle}


def load_body(name_or_path: str | Path) -> BodyModel:
    """A baked default body, or a body read from an SMPL file.

    The default bodies' betas span their own shape space: they are not SMPL's betas. Along every component the
    volume grows with beta. What the first three do, and their share of the variance:

    | body | beta[0] | beta[1] | beta[2] |
    | --- | --- | --- | --- |
    | female | stature, 90% | body mass, 5% | fuller waist and legs, shorter legs, 4% |
    | male | stature, 82% | narrower shoulders, fuller waist and hips, 13% | body mass, 3% |
    | neutral | stature; low is rather female, high rather male, 93% | narrower shoulders, fuller hips, 4% |
      body mass, 1% |

    Args:
        name_or_path: "female", "male", "neutral", or the path of an SMPL `.npz` or `.pkl` file (24 joints).

    Raises:
        InputError: unknown name, missing file, other kind of file, missing key, wrong shape, NaN, or a pickle
            that asks for anything besides arrays. Nothing inside a pickle is ever executed.
    """
    if str(name_or_path) in BODY_NAMES:
        return _load_default(str(name_or_path))
    path = Path(name_or_path)
    if path.suffix.lower() not in READERS:
        raise InputError(
            f"body '{name_or_path}' is unknown; allowed are {', '.join(BODY_NAMES)}, or the path of an SMPL "
            f"file ending in {' or '.join(READERS)}"
        )
    if not path.is_file():
        raise InputError(f"body file {path} does not exist; give the path of an SMPL .npz or .pkl file")
    return _model_from_arrays(
        READERS[path.suffix.lower()](path, REQUIRED + OPTIONAL), name=path.stem, source=str(path)
    )


@lru_cache(maxsize=len(BODY_NAMES))
def _load_default(name: str) -> BodyModel:
    arrays = read_npz(ASSETS / f"{name}.npz", REQUIRED + OPTIONAL)
    return _model_from_arrays(arrays, name=name, source=str(arrays["source"]))


def _model_from_arrays(arrays: dict[str, Any], *, name: str, source: str) -> BodyModel:
    missing = [key for key in REQUIRED if key not in arrays]
    if "joint_template" not in arrays and "J_regressor" not in arrays:
        missing.append("J_regressor")
    if missing:
        raise InputError(
            f"{source}: no SMPL body: missing {', '.join(missing)}; of a body's keys it holds "
            f"{', '.join(sorted(arrays)) or 'none'}; give an SMPL model file (not a motion or a mesh)"
        )
    v_template = _floats(arrays, "v_template", source)
    parents = _parents(arrays["kintree_table"], source)
    shapedirs = _floats(arrays, "shapedirs", source)
    if "joint_template" in arrays:
        joint_template = _floats(arrays, "joint_template", source)
        joint_shapedirs = _floats(arrays, "joint_shapedirs", source)
    else:
        regressor = _floats(arrays, "J_regressor", source)
        if regressor.shape != (NUM_JOINTS, len(v_template)) or shapedirs.ndim != 3:
            raise InputError(
                f"{source}: J_regressor {regressor.shape} and shapedirs {shapedirs.shape} do not fit "
                f"{NUM_JOINTS} joints and {len(v_template)} vertices"
            )
        joint_template = regressor @ v_template
        joint_shapedirs = np.einsum("jv,vab->jab", regressor, shapedirs)
    weights = _floats(arrays, "weights", source)
    return BodyModel(
        name=name,
        v_template=v_template,
        shapedirs=shapedirs,
        posedirs=_posedirs(_floats(arrays, "posedirs", source), len(v_template)),
        weights=weights,
        parents=parents,
        faces=np.ascontiguousarray(_array(arrays, "f", source), dtype=np.int32),
        joint_template=joint_template,
        joint_shapedirs=joint_shapedirs,
        source=source,
    )


def _array(arrays: dict[str, Any], key: str, source: str) -> NDArray[Any]:
    array = np.asarray(arrays[key])
    if array.dtype.kind not in "fiu":
        raise InputError(f"{source}: {key} holds {array.dtype} values; a body needs numbers there")
    return array


def _floats(arrays: dict[str, Any], key: str, source: str) -> NDArray[np.float64]:
    """The array in float64, multiplied by its scale where the file stores integers with a scale."""
    array = np.ascontiguousarray(_array(arrays, key, source), dtype=np.float64)
    scale = arrays.get(f"{key}_scale")
    return array if scale is None else array * float(scale)


def _parents(kintree_table: Any, source: str) -> NDArray[np.int32]:
    table = np.asarray(kintree_table)
    if table.shape != (2, NUM_JOINTS):
        raise InputError(
            f"{source}: kintree_table has shape {table.shape}; allowed is (2, {NUM_JOINTS}), an SMPL body; "
            "SMPL-H and SMPL-X files have more joints and are not read"
        )
    parents = table[0].astype(np.int64)
    # SMPL's files mark the root by 2^32 - 1, which is -1 in 32 bits.
    parents[parents == 4294967295] = -1
    return parents.astype(np.int32)


def _posedirs(posedirs: NDArray[np.float64], vertices: int) -> NDArray[np.float64]:
    """(V, 3, 207) from that, from (3 V, 207), or from the transposed (207, 3 V) that some files hold."""
    if posedirs.shape == (NUM_POSE_FEATURES, 3 * vertices):
        posedirs = np.ascontiguousarray(posedirs.T)
    if posedirs.shape == (3 * vertices, NUM_POSE_FEATURES):
        posedirs = posedirs.reshape(vertices, 3, NUM_POSE_FEATURES)
    return posedirs
