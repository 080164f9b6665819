"""The report's figures from cloth of which they are known, and that nothing broken is written."""

import json
from dataclasses import replace

import numpy as np
import pytest

from taichi_tryon import __version__
from taichi_tryon.output import report
from taichi_tryon.output.observation import Inspection


@pytest.fixture
def seen() -> Inspection:
    return Inspection(
        name="cloth",
        triangles=np.array([[0, 1, 2], [1, 3, 2]]),
        positions=np.zeros((4, 3)),
        velocities=np.array([[0, 0, 0], [0.003, 0, 0.004], [0, 0, 0], [0, 0.001, 0]]),
        gaps=np.array([0.001, 0.002, 0.003, 0.004]),
        pressures=np.zeros(4),
        contact_forces=np.array([[0.0, 2.0, 0.1], [0, 0.5, 0], [0, 0, 0], [0, 0, 0]]),
        strains={
            "strain_warp_percent": np.array([-2.0, 1.0]),
            "strain_weft_percent": np.array([0.5, 0.5]),
            "shear_degree": np.array([3.0, -5.0]),
        },
        net_forces=np.array([[0.003, 0, 0], [0, -0.004, 0], [0, 0, 0], [0, 0, 0]]),
        weights=np.full(4, 0.5),
        depths=np.array([0.0, 0.00025]),
        inside=np.array([0, 3]),
        samples=np.array([10, 20]),
        contact_pressures=np.array([0.0, 1000.0, 3000.0, 0.0]),
        contact_areas=np.array([4.0, 3.0, 1.0, 2.0]),
        normal_force=np.array([0.0, 2.25, 0.0]),
        skin_pressures=np.array([0.0, 500.0, 500.0, 1500.0]),
        skin_areas=np.array([90.0, 1.0, 1.0, 1.0]),
        energies={"stretch": 1.0, "shear": 2.0, "bend": 3.0, "gravity": -4.0},
        crossings=np.zeros((2, 2), int),
    )


def test_quality(seen):
    found = report.quality(seen)
    assert found["residual_relative"] == pytest.approx(0.005)
    assert found["speed_max_mm_s"] == pytest.approx(5)
    assert found["penetration_mm"] == pytest.approx(0.25)
    assert found["penetrating_samples_percent"] == pytest.approx(10)
    assert found["strain_percent"]["warp"]["max"] == 2 and found["strain_percent"]["warp"]["p50"] == 1.5
    assert found["strain_percent"]["weft"] == {"p50": 0.5, "p99": 0.5, "max": 0.5}
    assert found["shear_degree"]["max"] == 5
    assert found["gap_mm"]["p50"] == 2.5 and found["gap_mm"]["max"] == 4
    assert found["contact_area_percent"] == pytest.approx(40)
    assert found["pressure_kPa"]["max"] == 3 and 1 <= found["pressure_kPa"]["p50"] < 2
    assert found["body_pressure_kPa"]["max"] == 1.5 and found["body_pressure_kPa"]["p50"] == 0.5
    assert found["contact_force_N"] == {"normal": [0, 2.25, 0], "friction": [0, 0.25, 0.1]}
    assert found["energy_J"] == seen.energies
    assert found["crossing_triangle_pairs"] == 2


def test_cloth_off_the_body_presses_with_nothing(seen):
    seen.contact_pressures[:] = 0
    found = report.quality(seen)
    assert found["pressure_kPa"] == {"p50": 0, "p95": 0, "max": 0} and found["contact_area_percent"] == 0


def test_mesh_figures():
    found = report.mesh_figures(np.array([0.01, 0.02, 0.03]), 3, 1, 41.25)
    assert found["edge_length_mm"] == {"mean": 20, "min": 10, "max": 30}
    assert (found["vertices"], found["triangles"], found["min_angle_deg"]) == (3, 1, 41.25)


def test_versions():
    found = report.versions()
    assert set(found) == {"taichi_tryon", "taichi", "numpy", "python"}
    assert found["taichi_tryon"] == __version__ and found["numpy"] == np.__version__


def test_it_is_written_whole_with_its_schema(tmp_path, seen):
    report.write(tmp_path, {"quality": report.quality(seen)})
    read = json.loads((tmp_path / "report.json").read_text())
    assert read == {"schema": 1, "quality": report.quality(seen)}
    assert [path.name for path in tmp_path.iterdir()] == ["report.json"]


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), np.float64("-inf")])
def test_a_number_that_is_not_finite_is_never_written(tmp_path, bad):
    """Null stands for it, and a warning says where; the rest is kept."""
    holds = {"left": {"reaction_N": [1.0, bad, 3.0]}}
    report.write(tmp_path, {"quality": {"penetration_mm": bad, "x": 2.0}, "holds": holds, "warnings": ["earlier"]})
    read = json.loads((tmp_path / "report.json").read_text())
    assert read["quality"] == {"penetration_mm": None, "x": 2.0}
    assert read["holds"] == {"left": {"reaction_N": [1.0, None, 3.0]}}
    places = ("quality.penetration_mm", "holds.left.reaction_N.1")
    assert read["warnings"] == ["earlier", *(f"{place}: not a finite number" for place in places)]


def test_without_a_body_there_is_no_gap(seen):
    found = report.quality(replace(seen, gaps=None))
    assert found["gap_mm"] is None
    assert found == {**report.quality(seen), "gap_mm": None}
