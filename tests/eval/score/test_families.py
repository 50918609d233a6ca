"""Families of metrics through `compare`, on predictions whose figures are known."""

from dataclasses import replace

import numpy as np
import pytest

from muslin.eval.compare import compare
from muslin.eval.score.families import FAMILIES, STANDARD, chosen
from muslin.garments.errors import InputError
from muslin.sim.dataset.reader import write_dataset


@pytest.fixture
def score(tmp_path):
    """score(truth, prediction, **options): figures of samples of one id."""

    def run(truth, prediction, **options):
        truth, prediction = ([s] if not isinstance(s, list) else s for s in (truth, prediction))
        write_dataset(tmp_path / "t", truth)
        write_dataset(tmp_path / "p", prediction)
        return compare(tmp_path / "p", tmp_path / "t", **options)

    return run


def moved(sample, change):
    """A sample whose positions are change(positions, in metres and float64)."""
    return replace(sample, positions=change(sample.positions.astype(np.float64)).astype(np.float32))


def test_a_stretched_sheet_shows_its_stretch(score, make_sample):
    truth = make_sample("a", n=9)
    found = score(truth, moved(truth, lambda x: x * [1.1, 1.0, 1.0]), metrics=["strain", "change"]).figures
    strain = found["strain"]["prediction"]
    assert strain["major"]["p50"] == pytest.approx(0.5 * (1.1**2 - 1.0), abs=1e-5)
    # Panel space has the warp along y: a stretch along x is one of the weft.
    assert strain["weft"]["p50"] == pytest.approx(0.105, abs=1e-5)
    assert strain["warp"]["p50"] == pytest.approx(0.0, abs=1e-5)
    assert found["strain"]["truth"]["major"]["max"] == pytest.approx(0.0, abs=1e-5)
    assert found["area_error"]["mean"] == pytest.approx(0.1, abs=1e-5)
    assert found["edge_length_error"]["max"] == pytest.approx(0.1, abs=1e-5)


def test_a_tilted_sheet_shows_its_angle_and_is_not_bent(score, make_sample):
    truth, angle = make_sample("a", n=9), np.radians(10.0)
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]]
    )
    found = score(truth, moved(truth, lambda x: x @ turn.T)).figures
    assert found["normal_error_deg"]["mean"] == pytest.approx(10.0, abs=1e-3)
    assert found["dihedral_error_deg"]["max"] == pytest.approx(0.0, abs=0.01)
    assert found["curvature_1_m"]["distance"] == pytest.approx(0.0, abs=0.01)


def test_waves_that_are_smoothed_away_show_in_the_spectrum_alone(score, make_sample):
    flat = make_sample("a", n=65)

    def wavy(height):
        return lambda x: x + [0.0, height, 0.0] * np.sin(2.0 * np.pi * x[..., :1] / 0.08)

    found = score(moved(flat, wavy(0.002)), moved(flat, wavy(0.001))).figures
    assert found["vertex_error_mm"]["max"] < 1.001
    # Half the height is a quarter of the energy, and the missing half as much.
    assert found["spectrum"]["wrinkles_kept"] == pytest.approx(0.25, abs=0.005)
    assert found["spectrum"]["wrinkles_error"] == pytest.approx(0.25, abs=0.005)
    assert found["panel_spectrum"]["kept"][3] == pytest.approx(0.25, abs=0.005)
    assert found["panel_spectrum"]["error"][3] == pytest.approx(0.25, abs=0.005)


def test_a_trembling_sequence_shows_its_jitter(score, make_sample):
    truth = make_sample("a", frames=12)
    steady = moved(truth, lambda x: x + np.arange(12)[:, None, None] ** 3 * [1e-5, 0.0, 0.0])
    still = score(steady, steady).figures
    # x = 1e-5 t^3 has the third difference 6e-5.
    assert still["jitter_m_s3"]["truth"] == pytest.approx(6e-5 * 30.0**3, rel=0.01)
    assert still["jitter_m_s3"]["ratio"] == 1.0


def test_noise_multiplies_the_jitter(score, make_sample):
    truth = make_sample("a", frames=12)
    steady = moved(truth, lambda x: x + np.arange(12)[:, None, None] ** 3 * [1e-5, 0.0, 0.0])
    noise = np.random.default_rng(1).normal(scale=1e-3, size=steady.positions.shape)
    found = score(steady, moved(steady, lambda x: x + noise)).figures
    expected = 1e-3 * 30.0**3 * np.sqrt(20.0) * np.sqrt(8.0 / np.pi)
    assert found["jitter_m_s3"]["prediction"] == pytest.approx(expected, rel=0.05)
    assert found["velocity_error_mm_s"]["mean"] == pytest.approx(
        30.0 * np.sqrt(2.0) * np.sqrt(8 / np.pi), rel=0.05
    )


def test_a_sheet_through_the_ball_crosses_it_along_a_circle(score, make_sample):
    truth, cut = make_sample("a", n=61), make_sample("a", n=61, height=0.1)
    found = score(truth, cut, metrics=["body-contact"]).figures
    radius = np.sqrt(0.2**2 - 0.1**2)
    assert found["body_intersections"]["contour_max_m"] == pytest.approx(2.0 * np.pi * radius, rel=0.01)
    assert found["penetration"]["area_ratio"] == pytest.approx(np.pi * radius**2 / 0.64, rel=0.01)
    assert found["truth_body_intersections"]["pairs_max"] == 0


def test_definitions_of_penetration_differ(score, make_sample):
    truth, close = make_sample("a", n=61), make_sample("a", n=61, height=0.2005)
    found = score(truth, close, metrics=["definitions", "body-contact"]).figures
    assert found["penetration"]["ratio"] == found["penetration_definitions"]["signed_distance"] == 0.0
    assert found["penetration_definitions"]["face_centre"] > 0.0


def test_a_sheet_folded_through_itself_crosses_itself(score, make_sample):
    truth = make_sample("a", n=9, height=0.5)

    def folded(x):
        side = x.copy()
        right = side[..., 0] > 0.05
        # The right half comes back over the left, and dips through it towards its end.
        side[right] = side[right] * [-1.0, 1.0, 1.0] + [0.13, 0.0, 0.0]
        side[..., 1] += np.where(right, 0.05 + 0.2 * side[..., 0], 0.0)
        return side

    found = score(truth, moved(truth, folded), metrics=["self-contact"]).figures
    assert found["self_intersections"]["pairs_max"] > 0
    assert found["self_intersections"]["contour_max_m"] == pytest.approx(0.8, rel=0.02)
    assert found["truth_self_intersections"]["pairs_max"] == 0


def test_energies_are_those_of_the_truths_fabric(score, make_sample):
    truth = make_sample("a", n=9)
    lifted = moved(truth, lambda x: x + np.array([0.0, 0.1, 0.0]))
    found = score(truth, lifted, metrics=["all"]).figures["energy_j"]
    # gray interlock weighs 0.1872 kg/m^2
    assert found["excess"]["gravity"] == pytest.approx(0.187 * 0.64 * 9.81 * 0.1, rel=0.05)
    assert found["excess"]["stretch"] == pytest.approx(0.0, abs=1e-6)


def test_figures_of_several_samples_are_over_all_their_values(score, make_sample):
    truth = [make_sample("a"), make_sample("b", n=5)]
    up = np.array([0.0, 0.001, 0.0])
    lifted = [moved(truth[0], lambda x: x + up), moved(truth[1], lambda x: x + 2.0 * up)]
    found = score(truth, lifted, metrics=["vertex", "change"])
    counts = np.array([81, 25])
    assert found.figures["vertex_error_mm"]["mean"] == pytest.approx(
        counts @ [1.0, 2.0] / counts.sum(), abs=1e-4
    )
    assert [pair.figures["vertex_error_mm"]["max"] for pair in found.pairs] == pytest.approx(
        [1.0, 2.0], abs=1e-4
    )
    assert found.pairs[0].frames["vertex_mean"] == pytest.approx([1.0], abs=1e-4)


def test_only_what_is_chosen_is_computed(score, make_sample):
    found = score(make_sample("a"), make_sample("a"), metrics=["change", "vertex"])
    names = {"vertex_error_mm", "vertex_error_area_weighted_mm", "edge_length_error", "area_error", "cost"}
    assert set(found.figures) == names


def test_what_some_samples_lack_is_counted(score, make_sample):
    truth = [make_sample("a"), make_sample("b", body=False)]
    found = score(truth, truth)
    (note,) = [note for note in found.notes if "body" in note]
    assert note.endswith("(1 of 2 samples)")
    assert found.pairs[0].figures["penetration"] is not None
    assert found.pairs[1].figures["penetration"] is None


def test_names_of_families():
    assert set(STANDARD) == set(FAMILIES) - {"energy", "definitions"}
    assert [family.name for family in chosen(["change", "vertex"])] == ["vertex", "change"]
    assert len(chosen(["all"])) == len(FAMILIES)
    for wrong in (["speed"], []):
        with pytest.raises(InputError, match="choose from standard, all, vertex"):
            chosen(wrong)


def test_meshes_without_correspondence_have_normals_of_nearest_points(tmp_path):
    plane = "v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\n"
    tilted = "v 0 0 0\nv 1 0.2 0\nv 1 0.2 1\nv 0 0 1\n"
    (tmp_path / "a.obj").write_text(plane + "f 1 2 3\nf 1 3 4\n")
    (tmp_path / "b.obj").write_text(tilted + "f 1 2 4\nf 2 3 4\n")
    figures = compare(tmp_path / "a.obj", tmp_path / "b.obj", metrics=["normals"]).figures
    assert figures["normal_error_deg"] is None
    assert figures["normal_distance_deg"] == pytest.approx(np.degrees(np.arctan(0.2)), abs=1e-6)


def test_a_prediction_without_area_has_null_surface_distances(score, make_sample):
    truth = make_sample("a", n=5)
    found = score(truth, moved(truth, lambda x: x * [1.0, 1.0, 0.0]), metrics=["vertex", "surface"])
    assert found.figures["hausdorff_mm"] is None
    assert found.pairs[0].figures["mean_surface_distance_mm"] is None
    assert found.figures["vertex_error_mm"]["max"] > 0.0
    assert any("surface distances are null" in note and "area" in note for note in found.notes)
