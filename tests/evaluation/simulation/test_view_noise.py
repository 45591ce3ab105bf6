"""View hypotheses made from truth err as they say; errors of view and spin are what they should be."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from visup.agent import Pose, Spin
from visup.agent.model.orientation import orientations, swing_and_roll
from visup.evaluation.missions.pose_errors import spin_error, view_error
from visup.evaluation.simulation.view_noise import NoisyViews, ViewNoise
from visup.percepts.shape.building.mesh_views import half_sphere_directions


def view_errors(
    noise: ViewNoise, count: int = 600, others: tuple[str, ...] = ("mir",)
) -> list[list[float]]:
    """For each look the angles of its hypotheses from the truth, degrees; inf for another model."""
    source = NoisyViews("sat", half_sphere_directions(48), noise, np.random.default_rng(1), others)
    errors = []
    for k, true in enumerate(Rotation.random(count, random_state=2).as_matrix()):
        hypotheses = source(true, k)
        orientations_ = [
            orientations(h.direction or (1, 0, 0), h.rotation or 0.0) for h in hypotheses
        ]
        swings = [float(np.degrees(swing_and_roll(s, true)[0])) for s in orientations_]
        errors.append(
            [a if h.name == "sat" else np.inf for h, a in zip(hypotheses, swings, strict=True)]
        )
    return errors


def test_without_noise_the_nearest_view_comes_first() -> None:
    clean = ViewNoise(missing=0, wrong=0, twin=0, roll_deg=0, similarity_sigma=0)
    for angles in view_errors(clean):
        assert angles[0] < 20.0
        assert angles == sorted(angles)


def test_missing_and_wrong_reports_have_the_requested_rates() -> None:
    reports = view_errors(ViewNoise(missing=0.2, wrong=0.3, wrong_run=2.0, twin=0.0), count=3000)
    answered = [angles for angles in reports if angles]
    assert 1 - len(answered) / len(reports) == pytest.approx(0.2, abs=0.03)
    wrong = np.mean([angles[0] > 45.0 for angles in answered])
    assert wrong == pytest.approx(0.3, abs=0.05)


def test_errors_of_poses_are_measured_against_the_truth() -> None:
    turns = Rotation.from_rotvec(np.radians(4.0) * np.arange(50)[:, None] / 25 * [[0, 1, 0]])
    box = {"bbox": [300, 220, 40, 40]}
    frames = [
        {"index": k, "sat": {"quat_xyzw": q, **box}} for k, q in enumerate(turns.as_quat().tolist())
    ]
    truth = {"size": [640, 480], "fps": 25, "frames": frames}
    true = -turns[20].as_matrix()[2]
    aside = Rotation.from_rotvec([0, np.radians(30), 0]).apply(true)
    x, y, z = aside.tolist()
    pose = Pose("sat", 0, (x, y, z), 0.0, 0.0, spin=Spin(5.0, 0.1, (0, 1, 0)))
    assert view_error(truth, {(20, "sat"): pose}) == pytest.approx(30.0, abs=0.5)
    assert spin_error(truth, {(20, "sat"): pose}) == pytest.approx(1.0, abs=1e-6)
    assert view_error(truth, {}) is None
    assert spin_error(truth, {}) is None
