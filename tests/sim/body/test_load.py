from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sparse
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.sim.body import BodyModel, load_body

Arrays = dict[str, NDArray[Any]]


def write(path: Path, arrays: dict[str, Any]) -> Path:
    if path.suffix == ".npz":
        np.savez(path, **arrays)
    else:
        path.write_bytes(pickle.dumps(arrays, protocol=2))
    return path


def expect_same_body(model: BodyModel, arrays: Arrays) -> None:
    for key in ("v_template", "shapedirs", "posedirs", "weights"):
        np.testing.assert_array_equal(getattr(model, key), arrays[key])
    np.testing.assert_array_equal(model.faces, arrays["f"])
    assert model.parents.tolist() == [-1, *arrays["kintree_table"][0, 1:].tolist()]
    # joints regressed from the shaped body are what the affine joints give
    beta = np.linspace(-2.0, 2.0, 10)
    regressed = arrays["J_regressor"] @ (arrays["v_template"] + arrays["shapedirs"] @ beta)
    np.testing.assert_allclose(model.joints(beta), regressed, atol=1e-13)


@pytest.mark.parametrize("suffix", [".npz", ".pkl"])
def test_round_trip(tmp_path: Path, smpl_arrays: Arrays, suffix: str) -> None:
    model = load_body(write(tmp_path / f"made_up{suffix}", smpl_arrays))
    expect_same_body(model, smpl_arrays)
    assert model.name == "made_up"
    assert model.source == str(tmp_path / f"made_up{suffix}")


@pytest.mark.parametrize("suffix", [".npz", ".pkl"])
def test_sparse_regressor(tmp_path: Path, smpl_arrays: Arrays, suffix: str) -> None:
    arrays: dict[str, Any] = dict(smpl_arrays, J_regressor=sparse.csc_matrix(smpl_arrays["J_regressor"]))
    expect_same_body(load_body(write(tmp_path / f"body{suffix}", arrays)), smpl_arrays)


@pytest.mark.parametrize("transposed", [False, True])
def test_flattened_pose_shapes(tmp_path: Path, smpl_arrays: Arrays, transposed: bool) -> None:
    flat = smpl_arrays["posedirs"].reshape(-1, 207)
    arrays = dict(smpl_arrays, posedirs=flat.T if transposed else flat)
    expect_same_body(load_body(write(tmp_path / "body.npz", arrays)), smpl_arrays)


def test_many_betas(tmp_path: Path, smpl_arrays: Arrays) -> None:
    arrays = dict(smpl_arrays, shapedirs=np.random.default_rng(0).normal(size=(60, 3, 300)))
    assert load_body(write(tmp_path / "body.npz", arrays)).num_betas == 300


def test_float32_and_fortran_order_are_read_exactly(tmp_path: Path, smpl_arrays: Arrays) -> None:
    arrays = {
        k: np.asfortranarray(v.astype(np.float32) if v.dtype == float else v) for k, v in smpl_arrays.items()
    }
    model = load_body(write(tmp_path / "body.pkl", arrays))
    assert model.v_template.dtype == np.float64
    np.testing.assert_array_equal(model.posedirs, smpl_arrays["posedirs"].astype(np.float32))


def test_default_bodies_load_by_name_and_by_path() -> None:
    by_name = load_body("female")
    assert by_name is load_body("female")
    assert "anny" in by_name.source


@pytest.mark.parametrize("key", ["v_template", "J_regressor", "weights", "f", "kintree_table"])
def test_missing_key_is_named(tmp_path: Path, smpl_arrays: Arrays, key: str) -> None:
    del smpl_arrays[key]
    with pytest.raises(InputError, match=f"missing {key}"):
        load_body(write(tmp_path / "body.npz", smpl_arrays))


@pytest.mark.parametrize("key", ["v_template", "shapedirs", "posedirs", "weights", "J_regressor"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_not_finite_is_refused(tmp_path: Path, smpl_arrays: Arrays, key: str, value: float) -> None:
    smpl_arrays[key].flat[3] = value
    with pytest.raises(InputError, match="NaN or infinity"):
        load_body(write(tmp_path / "body.npz", smpl_arrays))


def test_more_joints_are_refused(tmp_path: Path, smpl_arrays: Arrays) -> None:
    smpl_arrays["kintree_table"] = np.zeros((2, 52), dtype=np.int64)
    with pytest.raises(InputError, match=r"SMPL-H and SMPL-X"):
        load_body(write(tmp_path / "smplh.npz", smpl_arrays))


def test_arrays_of_the_wrong_kind_are_refused(tmp_path: Path, smpl_arrays: Arrays) -> None:
    smpl_arrays["weights"] = np.array(["heavy", "light"])
    with pytest.raises(InputError, match="weights holds <U5"):
        load_body(write(tmp_path / "body.npz", smpl_arrays))


def test_regressor_that_does_not_fit_is_refused(tmp_path: Path, smpl_arrays: Arrays) -> None:
    smpl_arrays["J_regressor"] = smpl_arrays["J_regressor"][:, :50]
    with pytest.raises(InputError, match=r"J_regressor \(24, 50\)"):
        load_body(write(tmp_path / "body.npz", smpl_arrays))


@pytest.mark.parametrize("name", ["femael", "body.obj", "body.fbx", "SMPL"])
def test_unknown_body_names_what_is_allowed(name: str) -> None:
    with pytest.raises(InputError, match=r"unknown; allowed are female, male, neutral"):
        load_body(name)


@pytest.mark.parametrize("suffix", [".npz", ".pkl"])
def test_missing_file(tmp_path: Path, suffix: str) -> None:
    with pytest.raises(InputError, match="does not exist"):
        load_body(tmp_path / f"nowhere{suffix}")


@pytest.mark.parametrize("suffix", [".npz", ".pkl"])
@pytest.mark.parametrize("content", [b"", b"hello", b"PK\x03\x04 cut", b"\x80\x02}q\x00(X\x01"])
def test_damaged_file(tmp_path: Path, suffix: str, content: bytes) -> None:
    path = tmp_path / f"body{suffix}"
    path.write_bytes(content)
    with pytest.raises(InputError, match=str(path)):
        load_body(path)


@pytest.mark.parametrize("suffix", [".npz", ".pkl"])
@pytest.mark.parametrize("share", [0.1, 0.5, 0.99])
def test_truncated_file(tmp_path: Path, smpl_arrays: Arrays, suffix: str, share: float) -> None:
    path = write(tmp_path / f"body{suffix}", smpl_arrays)
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(InputError, match=str(path)):
        load_body(path)


def test_a_motion_is_no_body(tmp_path: Path) -> None:
    motion = {"poses": np.zeros((5, 156)), "trans": np.zeros((5, 3)), "mocap_framerate": np.float64(120)}
    with pytest.raises(InputError, match="no SMPL body"):
        load_body(write(tmp_path / "motion.npz", motion))
