"""What is remembered of objects between frames."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.percepts.motion.features.test_superpixels_jit import cells_of
from visup.percepts.motion.layers.affine import Affine
from visup.percepts.motion.layers.affine_rate import AffineRate
from visup.percepts.motion.layers.dense_labelling import Labelling
from visup.percepts.motion.tracks.track import PartMotion, Track
from visup.percepts.motion.tracks.track_prediction import predict_tracks
from visup.percepts.motion.tracks.track_update import update_track

STEP_S = 0.04


def rate(vx: float, vy: float, time: float = 0.0, span_s: float = STEP_S) -> AffineRate:
    return AffineRate(np.array([[0, 0, vx], [0, 0, vy]], dtype=np.float64), 1.0, time, span_s)


@given(st.integers(0, 99))
@settings(deadline=None, max_examples=6)
def test_what_is_hidden_does_not_wear_away(seed: int) -> None:
    cells = cells_of(seed)
    ys, xs = np.mgrid[: cells.labels.shape[0], : cells.labels.shape[1]]
    disc = (np.hypot(xs - 48, ys - 36) < 25).astype(np.float32)
    share = (cells.mean(disc) > 0.5).astype(np.float32)
    motions = (PartMotion().with_rate(1, rate(0, 0), 20.0),)
    track = Track(1, 1, 0.0, 0.0, share, motions=motions, predicted_share=share, frames=9)
    still = np.zeros((*cells.labels.shape, 2), np.float32)
    hidden = []
    for n in range(30):
        posterior = np.zeros((cells.count, 4), np.float32)
        posterior[:, 2] = 1  # another object is everywhere
        labelling = Labelling(posterior, posterior.argmax(axis=1))
        track = update_track(track, 1, labelling, cells, n * STEP_S, 50.0)
        assert track.occluded is not None
        assert track.mostly_occluded
        hidden.append(track.occluded)
        new = cells_of(seed + 1 + n)
        (track,) = predict_tracks((track,), still, cells, new, STEP_S)
        cells = new
    assert np.minimum(hidden[0], hidden[-1]).sum() > 0.97 * np.maximum(hidden[0], hidden[-1]).sum()


def test_what_fades_before_an_occluder_is_hidden_all_the_same() -> None:
    """A cell passes from one object to another by way of frames in which neither has half of it."""
    cells = cells_of(3)
    still = np.zeros((*cells.labels.shape, 2), np.float32)
    motions = (PartMotion().with_rate(1, rate(0, 0), 20.0),)
    ones = np.ones(cells.count, np.float32)
    track = Track(1, 1, 0.0, 0.0, ones, motions=motions, predicted_share=ones, frames=9)
    for shares in ([0.1, 0.48, 0.42, 0.0], [0.1, 0.3, 0.6, 0.0]):
        posterior = np.tile(np.array(shares, np.float32), (cells.count, 1))
        labelling = Labelling(posterior, posterior.argmax(axis=1))
        track = update_track(track, 1, labelling, cells, STEP_S, 50.0)
        (track,) = predict_tracks((track,), still, cells, cells, STEP_S)
    assert track.occluded is not None
    assert track.occluded.mean() > 0.95


@given(
    st.lists(st.tuples(st.floats(0.01, 0.3), st.floats(-9, 9)), min_size=2, max_size=30),
    st.floats(0.01, 3.0),
)
@settings(deadline=None, max_examples=40)
def test_the_way_gone_is_that_from_the_nearest_time_known(
    steps: list[tuple[float, float]], span_s: float
) -> None:
    times = np.cumsum([dt for dt, _ in steps]).tolist()
    path = tuple((t, x, -x) for t, (_, x) in zip(times, steps, strict=True))
    went = Track(1, 1, 0.0, 0.0, np.zeros(1, np.float32), path=path)._displacement_over(span_s)
    then = min(path, key=lambda p: abs(times[-1] - span_s - p[0]))
    scale = span_s / max(times[-1] - then[0], 1e-6)
    assert went == pytest.approx(((path[-1][1] - then[1]) * scale, (path[-1][2] - then[2]) * scale))


@given(st.lists(st.floats(-2, 2), min_size=12, max_size=12), st.floats(0, 200), st.floats(0, 200))
@settings(deadline=None, max_examples=30)
def test_the_shift_of_one_place_is_what_arrays_say(c: list[float], x: float, y: float) -> None:
    matrix, bend = np.array(c[:6]).reshape(2, 3), np.array(c[6:]).reshape(2, 3)
    for model in (Affine(matrix), Affine(matrix, bend=bend)):
        found = model.at(np.array([[x, y]], np.float32))[0]
        assert model.shift((x, y)) == pytest.approx(found.tolist(), rel=1e-4, abs=1e-2)


def test_a_velocity_from_frame_to_frame_is_averaged_over_the_last_few() -> None:
    rng = np.random.default_rng(1)
    path, x = [(0.0, 0.0, 0.0)], 0.0
    for n in range(1, 20):
        x += 2.0 + rng.normal(0, 0.2)
        path.append((n * STEP_S, x, 0.0))
    noisy = PartMotion().with_rate(1, rate(56.0, 0, time=19 * STEP_S), 20.0)
    track = Track(1, 1, 0.0, 0.0, np.zeros(1, np.float32), motions=(noisy,), path=tuple(path))
    assert abs(track.velocity((0.0, 0.0))[0] - 50.0) < 3.0
    slow = PartMotion().with_rate(30, rate(56.0, 0, time=19 * STEP_S, span_s=1.2), 20.0)
    track = Track(1, 1, 0.0, 0.0, np.zeros(1, np.float32), motions=(slow,), path=tuple(path))
    assert track.velocity((0.0, 0.0))[0] == 56.0
