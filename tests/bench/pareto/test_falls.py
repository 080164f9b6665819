"""Records of a fall, from tracks that are known."""

import numpy as np
import pytest

from taichi_tryon.bench.pareto import compare, falls, hang, sphere
from taichi_tryon.bench.pareto.falls import AS_IS, solver
from taichi_tryon.bench.pareto.peer import PeerSetting
from taichi_tryon.bench.pareto.problem import FABRICS
from taichi_tryon.bench.pareto.reference import Reference
from taichi_tryon.bench.pareto.track import Track
from taichi_tryon.errors import RunError

LOWEST = np.array([0.0, -0.1, -0.4])
BROKEN = solver(step_s=0.1)


def track(away: float, cpu_s: float, strain: float = 0.004, depth: float = 0.0) -> Track:
    """3 frames, ``away`` [m] from where they should be."""
    positions = np.tile([away, 0.0, 0.0], (4, 1))
    return Track(
        positions, LOWEST + away, np.array([0.1, 0.0, strain]), np.array([0, 0.002, depth]), cpu_s, 2 * cpu_s, 3.0
    )


@pytest.fixture
def known(monkeypatch):
    """Every run gives the track of its setting's name."""
    tracks = {
        "as is": track(0.002, 0.3),
        falls.MOTION.name: track(0.001, 0.5),
        "CG, 1 a frame": track(0.004, 0.9, strain=0.02),
        "CG, 5 a frame": track(0.001, 6.0),
    }

    def run(function, of, setting):
        if setting is BROKEN:
            raise RunError("no step can be done")
        return tracks[setting.name]

    monkeypatch.setattr(falls, "apart", run)
    monkeypatch.setattr(falls.peer, "version", lambda: "MuJoCo 4")
    for module in (falls, hang):
        monkeypatch.setattr(module, "falling", lambda *of: Reference(track(0.0, 50.0), 0.0001))


def values(records, **where):
    return {record.quantity: record.value for record in records if where.items() <= record.parameters.items()}


def test_a_setting_has_its_time_a_frame_and_its_errors(known):
    found = list(falls.records(hang.problem(6, "table1", 0.5), (AS_IS, BROKEN)))
    assert values(found, setting="as is") == pytest.approx(
        {
            "cpu_ms": 100.0,
            "wall_ms": 200.0,
            "position_error": 2.0,
            "strain_p99_at_end": 0.4,
            "strain_p99_worst_frame": 10.0,
            "penetration_at_end": 0.0,
            "penetration_worst_frame": 2.0,
            "lowest_point": 0.5,
        }
    )
    assert values(found, setting=BROKEN.name) == {"failed": 1}
    assert found[0].quantity == "converged_to" and found[0].value == pytest.approx(0.1)
    assert [record.limit for record in found if record.quantity == "lowest_point"] == [None]


def test_the_fall_is_judged_with_the_scheme_for_motion(known):
    found = falls.records(hang.problem(6, "table1", 0.5), (AS_IS, falls.MOTION))
    assert [record.limit for record in found if record.quantity == "lowest_point"] == [None, falls.compare.FALL]


def test_a_peer_is_told_to_solve_another_sheet_where_it_does(known):
    runs = {of: list(falls.records(hang.problem(6, of, 0.5), (), (PeerSetting(1),))) for of in FABRICS}
    assert "solved" not in runs["isotropic"][-1].parameters
    assert runs["table1"][-1].parameters["solved"] == "an isotropic sheet instead"
    assert runs["table1"][-1].limit is None


def test_hanging_it_counts_only_against_what_errs_more(known, monkeypatch):
    monkeypatch.setattr(falls, "FEW", (AS_IS,))
    monkeypatch.setattr(hang.peer, "require", lambda: None)
    found = list(hang.records(quick=True, peers=True))
    assert values(found, than="MuJoCo 4, CG, 1 a frame") == pytest.approx(
        {"times_faster_wall": 3, "times_faster_cpu": 3}
    )
    assert values(found, than="MuJoCo 4, CG, 5 a frame") == {"times_faster_wall": 0, "times_faster_cpu": 0}
    judged = [record for record in found if record.limit == 10.0]
    assert len(judged) == 2 and not any(record.passes for record in judged)


def test_draped_it_counts_against_any_where_it_is_exact_itself(known, monkeypatch):
    monkeypatch.setattr(falls, "FEW", (AS_IS,))
    monkeypatch.setattr(sphere.peer, "require", lambda: None)
    found = list(sphere.records(quick=True, peers=True))
    assert values(found, than="MuJoCo 4, CG, 5 a frame")["times_faster_wall"] == pytest.approx(20)
    assert {record.limit: record.passes for record in found if record.quantity == "times_faster_wall"} == {
        2.5: True,
        10.0: True,
    }
    for spoilt in (track(0.002, 0.3, strain=0.006), track(0.002, 0.3, depth=0.001)):
        assert not sphere.is_exact(spoilt)


def test_the_fall_ends_where_the_lowest_point_rises_again():
    swings = np.array([0.0, -0.2, -0.5, -0.499, -0.51, -0.4, -0.6])
    assert compare.fall_ends(swings) == 5
    assert compare.fall_ends(swings[:5]) == 5
