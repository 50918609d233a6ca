"""The benchmark of contact metrics on a small setting: it compares with the slow ways as it goes."""

import numpy as np

from benchmarks.contact import EVERY, main
from tests.eval.metrics.shapes import lifted, sheet, sphere


def test_a_sheet_carried_through_a_ball(tmp_path, capsys):
    uv, faces = sheet(1.0, 1.0, 10, 10)
    ball, ball_faces = sphere(2, 0.5)
    frames = 2 * EVERY + 1
    # The body turns about z: the sheet's vertices each follow another part of it.
    angles = np.linspace(0.0, 0.6, frames)
    turned = [
        ball @ np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]]) for a in angles
    ]
    setting = tmp_path / "setting.npz"
    np.savez(
        setting, positions=lifted(uv - 0.5, 0.4), faces=faces, body=np.array(turned), body_faces=ball_faces
    )
    main(setting)
    said = capsys.readouterr().out
    assert f"of {frames - 1} frames" in said
    assert "(median of 2)" in said
    assert "'touched': 20" in said
