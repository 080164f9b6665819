"""The course of a simulation: its phases, its clock, its state, and what it does when no step can be done."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from taichi_tryon.body.density import gap
from taichi_tryon.cloth.hysteresis import SHEAR_REACH
from taichi_tryon.errors import RunError, StepFailure
from taichi_tryon.observe import Observer
from taichi_tryon.output import checkpoint
from taichi_tryon.run import Stop, _Run
from taichi_tryon.runtime import Device
from taichi_tryon.scene.load import load_scene
from taichi_tryon.scene.models import SceneSpec
from taichi_tryon.setup import prepare
from taichi_tryon.simulation import PHASES, Simulation
from taichi_tryon.solver.settings import StepResult
from taichi_tryon.timing import Stopwatch

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def simulation(make_cone_scene):
    """A cone of a fabric that rubs, in shear and in bending."""
    data = make_cone_scene()
    data["garments"][0]["fabric"] |= {
        "shear_hysteresis_gf_per_cm": 1.0,
        "bending_hysteresis_warp_gf_cm_per_cm": 0.05,
        "bending_hysteresis_weft_gf_cm_per_cm": 0.05,
    }
    data["output"]["checkpoint_s"] = 0
    scene = SceneSpec.model_validate_json(json.dumps(data))
    clock = Stopwatch()
    return Simulation(prepare(scene, clock), clock)


@pytest.fixture(scope="module")
def begin(simulation):
    """The state before the first step."""
    return simulation.state()


@pytest.fixture(scope="module")
def course(simulation, begin):
    """Phase before, phase after, time and state of every step, to the end."""
    simulation.restore(begin)
    rows = []
    while not simulation.finished:
        before = simulation.progress.phase
        simulation.advance()
        p = simulation.progress
        assert 0 <= simulation.fraction <= 1
        rows.append((before, p.phase, p.time, simulation.state()))
    return rows


def test_phases_follow_each_other(course):
    phases = [row[0] for row in course]
    assert list(dict.fromkeys(phases)) == ["dress", "lay", "drape", "settle"]  # nothing moves: the motion is left out
    assert phases == sorted(phases, key=PHASES.index)
    assert course[-1][1] == "done"


def test_dry_friction_begins_where_dressing_ends_and_remembers_flat_cloth(simulation, course):
    dressing = [state for before, after, _, state in course if after in ("dress", "lay")]
    worn = next(state for before, after, _, state in course if before == "lay" and after == "drape")
    for name in ("bend_anchors", "shear_anchors"):
        assert not any(state[name].any() for state in dressing)
        # what is bent or sheared by more than the reach has slipped, the rest holds on to flat cloth
        assert worn[name].any() and not worn[name].all()
    simulation.restore(worn)
    simulation.stepper.balance()
    shear = simulation.stepper.elastic.strain.to_numpy()[:, 2]
    assert worn["shear_anchors"][:, 0] == pytest.approx(shear - np.clip(shear, -SHEAR_REACH, SHEAR_REACH), abs=1e-12)


def test_the_drape_lasts_as_long_as_asked(course):
    times = [row[2] for row in course]
    assert (np.diff(times) > 0).all()
    first, last = (next(i for i, row in enumerate(course) if row[1] == phase) for phase in ("drape", "settle"))
    assert times[last] - times[first] == pytest.approx(0.1, abs=1e-9)


@pytest.mark.parametrize("scheme, limit", [("backward_euler", 0.01), ("tr_bdf2", 0.002)])
def test_steps_are_as_short_as_the_local_error_asks(simulation, begin, monkeypatch, scheme, limit):
    step, tried = simulation.stepper.step, []
    solver = simulation.scene.solver.model_copy(update={"error_mm": limit})
    monkeypatch.setattr(simulation, "scene", simulation.scene.model_copy(update={"solver": solver}))
    monkeypatch.setattr(simulation, "_moving", replace(simulation._moving, scheme=scheme))

    def spy(dt, **how):
        tried.append((simulation.progress.phase, dt, step(dt, **how)))
        return tried[-1][2]

    monkeypatch.setattr(simulation.stepper, "step", spy)
    simulation.restore(begin)
    while simulation.progress.phase in ("dress", "lay", "drape"):
        simulation.advance()
    drape = [(dt, result) for phase, dt, result in tried if phase == "drape"]
    done = [(dt, result.error) for dt, result in drape if result.accepted]
    lengths, errors = np.array(done).T
    print(f"{scheme}: {len(done)} steps of {1e3 * lengths.min():.2g} to {1e3 * lengths.max():.2g} ms")
    assert len(drape) > len(done)  # the first attempts were too long
    assert lengths.sum() == pytest.approx(0.1)
    assert (errors <= limit * 1e-3).all() and np.median(errors) > 0.2 * limit * 1e-3


def test_it_ends_in_equilibrium_outside_the_body(simulation, course):
    simulation.restore(course[-1][3])
    assert simulation.finished and simulation.settled
    setup, limit = simulation.setup, simulation.scene.settle.residual
    forces = simulation.stepper.net_forces()
    assert np.linalg.norm(forces) / np.linalg.norm(setup.cloth.masses * 9.81) <= limit
    gaps = gap(setup.body.posed(simulation.transforms), simulation.stepper.x.to_numpy())
    assert gaps.min() > 0
    # the cone hangs on the ball: it is held up by contact alone
    contact = simulation.stepper.contact
    touching = contact.depth.to_numpy() > 0
    up = contact.load.to_numpy()[touching].sum(axis=0)
    assert up[1] == pytest.approx(9.81 * setup.cloth.masses.sum(), rel=0.02)


def test_counts_add_up(course):
    state = course[-1][3]
    steps = int(state["progress_steps"])
    assert steps == len(course)
    assert int(state["progress_newton_iterations"]) >= steps
    assert int(state["progress_linear_iterations"]) >= int(state["progress_newton_iterations"])


@pytest.mark.parametrize("share", [0.2, 0.7])
def test_restored_it_goes_on_with_the_same_bits(simulation, course, share):
    middle = int(share * len(course))
    simulation.restore(course[middle][3])
    for _, _, time, state in course[middle + 1 : middle + 5]:
        simulation.advance()
        assert simulation.progress.time == time
        for name, values in simulation.state().items():
            assert np.array_equal(values, state[name]), name


def test_where_no_step_can_be_done_it_fails_and_keeps_the_last_state(simulation, course):
    good = course[len(course) // 3][3]
    bad = np.full_like(good["velocities"], np.nan)
    simulation.restore({**good, "velocities": bad, "progress_phase": np.array("drape")})
    with pytest.raises(RunError, match=r"solver.min_step_s = 1e-05 s lowers the energy, in phase drape at 0\.\d+ s"):
        simulation.advance()
    assert np.array_equal(simulation.stepper.x.to_numpy(), good["positions"])
    assert simulation.progress.steps == int(good["progress_steps"])
    assert simulation.progress.rejected >= 10


def test_where_the_energy_jumps_before_every_step_the_smallest_one_goes_over_it(simulation, course, monkeypatch):
    good = course[len(course) // 3][3]
    simulation.restore(good)
    step, settings, tried = simulation._try_step, simulation.stepper.settings, []

    def blocked():
        p = simulation.progress
        tried.append(p.dt)
        if simulation.stepper.settings.tolerated > settings.tolerated:
            return step()
        p.dt *= 0.5
        return StepResult(False, 1, 1, np.inf, 0.0, 0.0, 0.5)

    monkeypatch.setattr(simulation, "_try_step", blocked)
    simulation.advance()
    assert tried[-1] == simulation.scene.solver.min_step_s > tried[-2] / 2
    assert simulation.stepper.settings == settings
    assert simulation.progress.steps == int(good["progress_steps"]) + 1
    assert simulation.progress.rejected == int(good["progress_rejected"]) + len(tried) - 1


def test_where_there_is_too_much_contact_it_tries_shorter_steps(simulation, course, monkeypatch):
    minimise, tried, least = simulation.stepper.newton.minimise, [], 1e-3

    def crowded(inverse_dt, *how):
        tried.append(1 / inverse_dt)
        if 1 / inverse_dt > least:
            raise StepFailure("too much")
        return minimise(inverse_dt, *how)

    monkeypatch.setattr(simulation.stepper.newton, "minimise", crowded)
    good = course[len(course) // 3][3]
    simulation.restore(good)
    simulation.advance()
    assert len(tried) > 1 and (np.diff(tried) < 0).all() and tried[-1] <= least
    assert simulation.progress.steps == int(good["progress_steps"]) + 1
    assert simulation.progress.rejected == int(good["progress_rejected"]) + len(tried) - 1
    least = 0.0
    # while it is forced on, the next phase takes over
    for phase in ("lay", "drape"):
        simulation.advance()
        assert simulation.progress.phase == phase
    with pytest.raises(RunError, match=r"^too much, in phase drape at 0\.\d+ s$"):
        simulation.advance()
    assert simulation.progress.steps == int(good["progress_steps"]) + 1


def test_a_checkpoint_of_the_end_has_the_last_frame(simulation, begin, tmp_path, monkeypatch):
    """Who goes on from there has no step to do, and so none to write a frame of."""
    saved = []

    def save(folder, text, state):
        saved.append((str(state["progress_phase"]), int(state["frame_index"])))

    monkeypatch.setattr(checkpoint, "save", save)
    simulation.restore(begin)
    device = Device(arch="cpu", precision="f64", threads=1)
    one = _Run(simulation, tmp_path, "", Stopwatch(), device, lambda *_: None, None)
    assert one.go(Stop()).status == "settled"
    assert len(saved) > simulation.progress.steps
    assert [frames for phase, frames in saved if phase == "done"] == [one.recorder.index]


def test_the_scene_chooses_the_law_of_bending(simulation, make_cone_scene):
    data = make_cone_scene()
    data["mesh"]["bending"] = "constant"
    assert prepare(SceneSpec.model_validate_json(json.dumps(data)), Stopwatch()).cloth.bending == "constant"
    assert simulation.setup.cloth.bending == "mid_edge"


def test_a_loose_tube_stays_up_by_its_elastics_alone():
    """On an upright cylinder, nothing pinned, it would fall by 5 cm: friction where the elastics press carries it."""
    changes = ["gravity_m_s2=[0, 0, -9.81]", "contact.friction=0.3", "garments.0.holds={}", "mesh.edge_length_mm=10",
               "garments.0.sheet.size_cm=[31.9, 4]", "garments.0.sheet.tube_radius_cm=5.077", "drape.duration_s=0.1",
               "settle.residual=1e-2", "solver.preconditioner=block_jacobi"]  # fmt: skip
    scene = load_scene(ROOT / "configs/validation/waistband.yaml", changes)
    clock = Stopwatch()
    simulation = Simulation(prepare(scene, clock), clock)
    while not simulation.finished:
        simulation.advance()
    moved = (simulation.stepper.x.to_numpy() - simulation.setup.positions)[:, 2].mean()
    assert simulation.settled and abs(moved) < 1e-3
    weight = simulation.setup.cloth.masses.sum() * 9.81
    seen, _ = Observer(simulation).inspect()
    assert seen.contact_forces.sum(axis=0)[2] == pytest.approx(weight, rel=0.02)
    assert 0.3 * (seen.contact_pressures @ seen.contact_areas) > weight


def test_cloth_between_two_limbs_comes_to_rest_half_way_between_them():
    """They leave it no room; pushed out of the one into the other by turns, it never did."""
    changes = ["mesh.edge_length_mm=20", "solver.preconditioner=block_jacobi", "motion.1.duration_s=0.1",
               "drape.duration_s=0"]  # fmt: skip
    clock = Stopwatch()
    simulation = Simulation(prepare(load_scene(ROOT / "configs/validation/pinch.yaml", changes), clock), clock)
    while not simulation.finished:
        simulation.advance()
    x = simulation.stepper.x.to_numpy()
    balls = simulation.setup.body.posed(simulation.transforms)
    depths = np.array([-gap(balls, x, (group,)) for group in (0, 1)])
    caught = (depths > 5e-4).all(axis=0)
    assert simulation.settled and caught.sum() > 5 and depths[:, caught].max() > 2e-3
    assert depths[0, caught] == pytest.approx(depths[1, caught], abs=5e-5)


def test_sheets_that_start_deep_in_the_body_come_out_on_their_own_side(make_cone_scene):
    """10, 30 and 60 mm deep from above, as deep from below: the ball, of radius 15 cm around (0, 1, 0), lies between
    the two layers of each pair."""
    data = make_cone_scene()
    fabric = data.pop("garments")[0]["fabric"]
    starts = {f"{side}_{depth}": (x, 100 + (15 - depth / 10) * (1 if side == "upper" else -1))
              for depth, x in ((10, -7), (30, -2), (60, 3)) for side in ("upper", "lower")}  # fmt: skip
    data["garments"] = [
        {
            "name": name,
            "fabric": fabric,
            "sheet": {"size_cm": [4, 6], "origin_cm": [x, y, 3], "rotation_degree": [-90, 0, 0], "mesh": "regular"},
        }
        for name, (x, y) in starts.items()
    ]
    data |= {"mesh": {"edge_length_mm": 20}, "gravity_m_s2": [0, 0, 0], "drape": {"duration_s": 0.2}}
    data |= {"solver": {"preconditioner": "block_jacobi"}}
    clock = Stopwatch()
    simulation = Simulation(prepare(SceneSpec.model_validate(data), clock), clock)
    observer = Observer(simulation)
    assert observer.probe.look()[0].max() > 0.05
    while simulation.progress.phase == "drape":
        simulation.advance()
    assert observer.probe.look()[0].max() == 0
    positions = simulation.stepper.x.to_numpy()
    for part, (name, (_, y)) in zip(simulation.setup.cloth.parts, starts.items(), strict=True):
        assert (np.sign(positions[part.vertices, 1] - 1) == np.sign(y - 100)).all(), name


@pytest.mark.parametrize("radii", [(15, 15, 15), (42, 3, 3)], ids=["ball", "limb"])
def test_a_body_at_2_m_s_takes_a_hanging_sheet_along_and_stays_outside_of_it(make_cone_scene, radii):
    """A ball of radius 15 cm, or a limb 6 cm thick, goes half a metre within 0.375 s, at 2 m/s half way."""
    data = make_cone_scene()
    data["body"]["balls"]["ball"]["radii_cm"] = [radius * 2**0.5 for radius in radii]
    fabric = data.pop("garments")[0]["fabric"]
    sheet = {"size_cm": [40, 40], "origin_cm": [-20, 80, 0]}
    data["garments"] = [{"name": "sheet", "fabric": fabric, "sheet": sheet, "holds": {"top": {"edge": "top"}}}]
    data["pose"]["translation_cm"] = [0, 0, -30]
    there = {"name": "there", "translation_cm": [0, 0, 20]}
    data |= {"motion": [{"pose": there, "duration_s": 0.375}], "mesh": {"edge_length_mm": 20}}
    data |= {"drape": {"duration_s": 0}, "solver": {"preconditioner": "block_jacobi"}}
    clock = Stopwatch()
    simulation = Simulation(prepare(SceneSpec.model_validate(data), clock), clock)
    observer, depths, pressed = Observer(simulation), [], 0
    while simulation.progress.phase == "move":
        simulation.advance()
        depths.append(observer.probe.look()[0].max())
        pressed += simulation.stepper.contact.pressures().any()
    seen, _ = observer.inspect()
    assert pressed > 50 and max(depths) == 0.0
    assert seen.positions[:, 2].max() > 0.2
    assert max(np.abs(seen.strains[f"strain_{way}_percent"]).max() for way in ("warp", "weft")) < 5


def test_rounding_is_what_the_last_digits_make_and_changes_nothing(simulation, course):
    """At least as much as a change of positions a million times as great makes, over a million; where cloth lies on a
    body, rounding of its distance adds to that."""
    state = course[-1][-1]
    simulation.restore(state)
    found, after = simulation.rounding(), simulation.state()
    assert all(np.array_equal(state[key], after[key]) for key in state)
    rng, step = np.random.default_rng(1), simulation.stepper
    moves = 1e6 * np.spacing(state["positions"]) * rng.uniform(-0.5, 0.5, state["positions"].shape)
    still = step.net_forces()
    step.restore({**state, "positions": state["positions"] + moves})
    force = np.linalg.norm(step.net_forces() - still) / step.potential.weight
    simulation.restore(state)
    assert 0.5e-6 * force < found < 1e-6
