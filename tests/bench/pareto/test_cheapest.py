"""Only what the limits against MuJoCo ask: which runs are held against which."""

import numpy as np
import pytest

from taichi_tryon.bench.pareto import cheapest, falls, hang, peer
from taichi_tryon.bench.pareto.reference import Reference
from taichi_tryon.bench.pareto.track import Track

DRAPE, LOOSE = (setting.name for setting in cheapest.DRAPES)
(FALL,), _ = cheapest.QUICK_FALLS[12]


def track(seconds: float, strain: float = 0.004, away: float = 0.001) -> Track:
    frames = np.array([0.0, -0.1, -0.4])
    positions = np.tile([away, 0.0, 0.0], (4, 1))
    return Track(positions, frames, np.full(3, strain), np.zeros(3), seconds, seconds, 3.0)


@pytest.fixture
def found(monkeypatch):
    """Records of the quick case where each setting's track is known."""
    tracks = {DRAPE: track(0.03), LOOSE: track(0.01), FALL.name: track(0.02, away=0.003),
              "CG, 1 a frame": track(0.06, strain=0.02), "CG, 5 a frame": track(0.6, away=0.004)}  # fmt: skip
    monkeypatch.setattr(peer, "require", lambda: None)
    monkeypatch.setattr(peer, "version", lambda: "MuJoCo 4")
    monkeypatch.setattr(falls, "apart", lambda function, problem, setting: tracks[setting.name])
    for module in (falls, hang):
        monkeypatch.setattr(module, "falling", lambda *of: Reference(track(50.0, away=0.0), 0.0))

    def of(changes: dict, peers: bool = True):
        tracks.update(changes)
        return list(cheapest.records(True, peers))

    return of


def times_faster(records, case):
    return [(record.value, record.limit) for record in records
            if record.case == case and record.quantity == "times_faster_wall"]  # fmt: skip


def test_the_fastest_exact_drape_is_held_against_both_of_the_peers_settings(found):
    assert times_faster(found({}), "drop_on_sphere") == [(pytest.approx(6), 2.5), (pytest.approx(60), 10.0)]


def test_what_is_stretched_is_not_compared(found):
    records = found({LOOSE: track(0.01, strain=0.006)})
    assert times_faster(records, "drop_on_sphere") == [(pytest.approx(2), 2.5), (pytest.approx(20), 10.0)]


def test_a_fall_counts_only_against_what_errs_more(found):
    assert times_faster(found({}), "hang") == [(pytest.approx(30), 10.0)]
    assert times_faster(found({FALL.name: track(0.02, away=0.005)}), "hang") == [(0, 10.0)]


def test_without_peers_there_is_only_ours(found):
    assert {record.parameters.get("simulator") for record in found({}, peers=False)} == {falls.OURS}
