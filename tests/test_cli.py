"""The command line: what reaches the simulation, what is printed where, and the exit codes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

from taichi_tryon.cli import main
from taichi_tryon.errors import Interrupted, RunError

CONFIGS = Path(__file__).parents[1] / "configs"
SCENE = str(CONFIGS / "scenes" / "quick.yaml")
BODY = str(CONFIGS / "bodies" / "adult_woman_9AR.yaml")


def call(*arguments):
    """Exit code of a command."""
    with pytest.raises(SystemExit) as caught:
        main([str(argument) for argument in arguments])
    return caught.value.code or 0


@pytest.fixture
def simulation(monkeypatch):
    """Stands in for the simulation: remembers how it was called, and ends as told by ``raises`` and ``exit_code``."""
    fake = SimpleNamespace()
    fake.raises, fake.exit_code, fake.calls, fake.advice = None, 0, [], ""

    def run_scene(scene, output, **options):
        fake.calls.append((scene, output, options))
        if fake.raises:
            raise fake.raises
        options["progress"]("drape", 0.5, "t = 0.5 s")
        end = {"status": "settled", "reason": "residual 0.009", "advice": fake.advice}
        return SimpleNamespace(**end, exit_code=fake.exit_code, output=output)

    functions = {
        "run": run_scene,
        "check": lambda scene: [f"{scene.scene}: 1000 vertices", "skipped: nothing"],
        "window": lambda scene, **options: fake.calls.append((scene, options)),
    }
    for module, function in functions.items():
        stand_in = ModuleType(f"taichi_tryon.{module}")
        setattr(stand_in, "view_scene" if module == "window" else f"{module}_scene", function)
        monkeypatch.setitem(sys.modules, stand_in.__name__, stand_in)
    return fake


def test_run(simulation, capsys):
    assert call("run", SCENE) == 0
    [(scene, output, options)] = simulation.calls
    assert scene.scene == "quick" and output == Path("outputs/quick")
    assert options["arch"] is None and options["resume"] is False
    printed = capsys.readouterr()
    assert printed.out == "settled: residual 0.009\noutputs/quick\n"
    assert printed.err == "drape: 50 % t = 0.5 s\n"


def test_run_with_every_option(simulation, tmp_path, capsys):
    options = [
        "--output",
        tmp_path,
        "--set",
        "mesh.edge_length_mm=40",
        "--resume",
        "--arch",
        "cpu",
        "--precision",
        "f32",
    ]
    assert call("run", SCENE, *options, "--threads", 2, "--set", "contact.friction=0", "--quiet") == 0
    [(scene, output, got)] = simulation.calls
    assert (scene.mesh.edge_length_mm, scene.contact.friction) == (40, 0)
    assert (scene.solver.precision, scene.solver.threads) == ("f32", 2)
    assert output == tmp_path and got["arch"] == "cpu" and got["resume"] is True
    assert capsys.readouterr().err == ""


def test_what_to_try_is_printed(simulation, capsys):
    simulation.advice = "worst in top\ntry: ease"
    call("run", SCENE)
    assert capsys.readouterr().out == "settled: residual 0.009\nworst in top\ntry: ease\noutputs/quick\n"


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["--set", "mesh.edge_length_mm=[20, 30]", "--jobs", 3, "--resume"], (2, "outputs/batch", 3, None, (), True)),
        ([SCENE, "--arch", "cpu", "--output", "x"], (2, "x", 1, None, ("--arch", "cpu"), False)),
        (["--scheduler", "tcp://a:1", "--threads", 2], (1, "outputs/batch", 1, "tcp://a:1", (), False)),
    ],
)
def test_many_scenes_or_a_sweep_are_a_batch(monkeypatch, arguments, expected):
    from taichi_tryon.batch import command

    calls = []

    def run_many(scenes, variants, output, jobs, scheduler, options, *, resume, quiet):
        calls.append((len(scenes) * len(variants), str(output), jobs, scheduler, options, resume))
        return 3

    monkeypatch.setattr(command, "run_many", run_many)
    assert call("run", SCENE, *arguments) == 3
    assert calls == [expected]


@pytest.mark.parametrize("code", [0, 3, 130])
def test_exit_code_of_the_run(simulation, code):
    simulation.exit_code = code
    assert call("run", SCENE) == code


@pytest.mark.parametrize(
    ("error", "code", "text"),
    [
        (RunError("step too small"), 3, "step too small\n"),
        (Interrupted("stopped"), 130, "stopped\n"),
        (KeyboardInterrupt(), 130, ""),
        (ValueError("odd"), 3, "internal error: ValueError: odd (--debug shows where)\n"),
    ],
)
def test_errors(simulation, capsys, error, code, text):
    simulation.raises = error
    assert call("run", SCENE, "--quiet") == code
    printed = capsys.readouterr()
    assert printed.err.strip() == text.strip() and printed.out == ""


def test_debug_shows_the_traceback(simulation, capsys):
    simulation.raises = ValueError("odd")
    assert call("run", SCENE, "--debug") == 3
    assert "Traceback" in capsys.readouterr().err


def test_check(simulation, capsys):
    assert call("check", SCENE) == 0
    assert capsys.readouterr().out == "quick: 1000 vertices\nskipped: nothing\n"


def test_view(simulation):
    assert call("view", SCENE, "--arch", "cpu") == 0
    options = simulation.calls[0][1]
    assert options["arch"] == "cpu" and callable(options["progress"])


@pytest.mark.parametrize("command", ["run", "check", "view"])
def test_input_at_fault(simulation, command, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("bad.yaml").write_text("scene: bad\nposse: 1\n")
    assert call(command, "bad.yaml") == 2
    printed = capsys.readouterr()
    assert printed.out == "" and "bad.yaml:2:1: posse: unknown key; did you mean pose?" in printed.err
    assert simulation.calls == [] and [path.name for path in tmp_path.iterdir()] == ["bad.yaml"]


@pytest.mark.parametrize(
    "arguments", [["run"], ["run", SCENE, "--arch", "tpu"], ["walk"], ["run", SCENE, "--threads", 0]]
)
def test_usage_at_fault(arguments):
    assert call(*arguments) == 2


def test_schema(capsys):
    assert call("schema") == 0
    assert json.loads(capsys.readouterr().out)["title"] == "SceneSpec"
    assert call("schema", "--markdown") == 0
    assert capsys.readouterr().out == (CONFIGS / "SCHEMA.md").read_text(encoding="utf-8")


def test_body(capsys, tmp_path):
    mesh = tmp_path / "body.stl"
    pose = CONFIGS / "poses" / "standing.yaml"
    assert call("body", BODY, "--pose", pose, "--measure", "--output", mesh) == 0
    printed = capsys.readouterr().out
    assert "100 balls in 5 groups" in printed and "waist: 64.0 cm (published 64.0)" in printed
    assert mesh.stat().st_size > 100_000


def test_body_to_an_unknown_kind_of_file(capsys, tmp_path):
    assert call("body", BODY, "--output", tmp_path / "body.doc") == 2
    assert "must end in one of .png" in capsys.readouterr().err


def test_pattern(capsys, tmp_path):
    drawing = tmp_path / "top.svg"
    assert call("pattern", CONFIGS / "patterns" / "top_9AR.yaml", "--output", drawing) == 0
    printed = capsys.readouterr().out
    assert "panel back: " in printed and "seam 1 " in printed
    assert drawing.read_text().startswith("<?xml")


def test_bench(tmp_path, capsys, monkeypatch):
    from taichi_tryon.bench import suite
    from taichi_tryon.bench.record import relative

    calls, found = [], suite.Finished([relative("strip", {"cut": "warp"}, "force", "N", 1.1, 1.0, 5.0, 0.1)], {})
    monkeypatch.setattr(suite, "run_suite", lambda *options, **others: calls.append(options) or found)
    assert call("bench", "accuracy", "--quick", "--case", "uniaxial", "--output", tmp_path) == 0
    assert calls == [("accuracy", True, tmp_path, ["uniaxial"])]
    text = capsys.readouterr().out
    assert "MISSED" in text and "0 of 1 limits met" in text
    monkeypatch.setattr(suite, "run_suite", lambda *options, **others: suite.Finished([], {"strip": "no step"}))
    assert call("bench", "accuracy") == 3


def test_bench_of_an_unknown_suite(capsys):
    assert call("bench", "speed") == 2
    assert "no suite speed; suites: accuracy" in capsys.readouterr().err


def test_help_is_quick_to_load():
    code = "import sys; from taichi_tryon.cli import main\ntry: main(['--help'])\nfinally: print(*sys.modules)"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not {"taichi", "numpy", "scipy", "matplotlib", "pydantic"} & set(result.stdout.split())


def test_module_is_the_command():
    result = subprocess.run([sys.executable, "-m", "taichi_tryon", "run"], capture_output=True, text=True)
    assert result.returncode == 2 and "taichi-tryon run" in result.stderr


class Process:
    """A real ``run`` of a small scene in a process of its own."""

    def __init__(self, folder, *options):
        command = [sys.executable, "-m", "taichi_tryon", "run", folder / "scene.yaml", "--output", folder / "out"]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        self.process = subprocess.Popen([*command, *options], text=True, **pipes)

    def stop(self, number):
        """Send a signal in the middle of the drape."""
        for line in self.process.stderr:
            if line.startswith("drape"):
                self.process.send_signal(number)
                break

    def end(self):
        """(exit code, stdout, stderr from here)"""
        out, err = self.process.communicate(timeout=120)
        return self.process.returncode, out, err


def test_signals_interrupt_a_run_that_resumes_until_it_settles(make_cone_scene, tmp_path):
    cone_scene = make_cone_scene()
    cone_scene["drape"] = {"duration_s": 2.0}
    # the coarse space takes long to compile
    cone_scene["solver"] = {"preconditioner": "block_jacobi"}
    (tmp_path / "scene.yaml").write_text(json.dumps(cone_scene))
    time = 0.0
    for options, number in ([], signal.SIGTERM), (["--resume"], signal.SIGINT):
        run = Process(tmp_path, *options)
        run.stop(number)
        code, out, err = run.end()
        assert code == 130 and out.startswith("interrupted: ") and "Traceback" not in err
        report = json.loads((tmp_path / "out" / "report.json").read_text())
        assert report["status"] == "interrupted" and time < report["run"]["simulated_s"]
        time = report["run"]["simulated_s"]
    code, out, err = Process(tmp_path, "--resume").end()
    assert code == 0 and out.startswith("settled: ") and "Traceback" not in err
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["status"] == "settled" and report["run"]["simulated_s"] > max(time, 2)
    frames = sorted(path.name for path in (tmp_path / "out" / "frames").glob("frame_*.vtu"))
    assert frames == [f"frame_{index:04d}.vtu" for index in range(len(frames))] and len(frames) > 60


@pytest.mark.parametrize(
    ("output", "options", "text"),
    [
        ("file", [], "{output} is a file; choose another folder"),
        ("file/below", [], "/file is a file; choose another folder"),
        ("x" * 300, [], "cannot be a folder: File name too long"),
        ("nothing", ["--resume"], "checkpoint.npz: no checkpoint to resume from; leave --resume out to start anew"),
    ],
)
def test_outputs_that_cannot_be(tmp_path, capsys, output, options, text):
    (tmp_path / "file").write_text("mine")
    assert call("run", SCENE, "--output", tmp_path / output, "--quiet", *options) == 2
    printed = capsys.readouterr()
    assert text.format(output=tmp_path / output) in printed.err and printed.err.count("\n") == 1 and not printed.out
    assert [path.name for path in tmp_path.iterdir()] == ["file"] and (tmp_path / "file").read_text() == "mine"


def test_output_without_write_permission(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("os.access", lambda path, mode: not mode & os.W_OK)
    assert call("run", SCENE, "--output", tmp_path / "out", "--quiet") == 2
    assert f"{tmp_path} is not writable; choose another folder\n" in capsys.readouterr().err


def test_interrupted_before_the_first_step(tmp_path, capsys, monkeypatch):
    def start(*_):
        signal.raise_signal(signal.SIGTERM)

    monkeypatch.setattr("taichi_tryon.runtime.start", start)
    assert call("run", SCENE, "--output", tmp_path / "out", "--quiet") == 130
    assert capsys.readouterr().err == "interrupted before the first step: nothing is kept\n"
    assert not (tmp_path / "out").exists() and signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
