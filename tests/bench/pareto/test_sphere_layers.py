"""The sheet that feels itself: what is judged, and against what."""

import numpy as np
import pytest

from taichi_tryon.bench.pareto import falls, ours, peer, sphere_layers
from taichi_tryon.bench.pareto.falls import AS_IS, COARSE, solver
from taichi_tryon.bench.pareto.peer import PeerSetting
from taichi_tryon.bench.pareto.track import Track
from taichi_tryon.errors import RunError


def track(seconds, crossings=(0, 0), strain=0.001, depth=0.0) -> Track:
    frames = np.array([0.0, -0.1])
    return Track(np.zeros((2, 3)), frames, np.full(2, strain), np.full(2, depth), seconds, seconds, 2.0,
                 np.array(crossings))  # fmt: skip


@pytest.fixture
def found(monkeypatch):
    """Records where each setting's track is known."""
    monkeypatch.setattr(peer, "require", lambda: None)
    monkeypatch.setattr(peer, "version", lambda: "MuJoCo 4")

    def of(tracks: dict, peers=True, quick=False):
        def run(function, problem, setting):
            assert problem.layers
            if setting.name not in tracks:
                raise RunError("none is short enough")
            return tracks[setting.name]

        monkeypatch.setattr(falls, "apart", run)
        return list(sphere_layers.records(quick, peers))

    return of


def values(records, quantity):
    return [(record.value, record.limit, record.passes) for record in records if record.quantity == quantity]


TRACKS = {AS_IS.name: track(0.02), PeerSetting(1).name: track(0.04, (2, 0)), PeerSetting(5).name: track(0.2, (7, 3))}


def test_our_crossings_are_judged_and_the_peers_are_told(found):
    coarse = solver(**COARSE).name
    records = found({**TRACKS, coarse: track(0.01, (0, 1))})
    assert values(records, "crossing_triangle_pairs_worst_frame") == [(0, 0, True), (1, 0, False), (2, None, True),
                                                                      (7, None, True)]  # fmt: skip
    # the faster of ours crosses: it is not compared
    assert values(records, "times_faster_wall") == [(pytest.approx(2), None, True), (pytest.approx(10), 5.0, True)]


def test_what_fails_of_ours_is_missed_and_counts_for_nothing(found):
    records = found({name: track for name, track in TRACKS.items() if name != AS_IS.name})
    assert values(records, "failed") == [(1, 0, False), (1, 0, False)]
    assert values(records, "times_faster_wall") == [(0, None, True), (0, 5.0, False)]


def test_a_drape_that_is_stretched_is_not_compared_but_on_the_coarse_mesh(found):
    tracks = {**TRACKS, AS_IS.name: track(0.02, strain=0.006)}
    assert values(found(tracks), "times_faster_wall") == [(0, None, True), (0, 5.0, False)]
    assert values(found(tracks, quick=True), "times_faster_wall") == [
        (pytest.approx(2), None, True),
        (pytest.approx(10), None, True),
    ]


def test_without_peers_there_is_only_ours(found):
    assert {record.parameters["simulator"] for record in found(TRACKS, peers=False)} == {"taichi_tryon"}


def test_ours_feels_itself_and_is_looked_at_in_every_frame():
    of = sphere_layers.problem(11, 0.1)
    scene = ours.scene_of(of, AS_IS)
    assert scene.contact.layers is not None
    assert ours.follow(of, scene).crossings.tolist() == [0] * 6
