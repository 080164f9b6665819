"""The command line: what reaches the simulation, what is printed where, and the exit codes."""

from __future__ import annotations

import json
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
    fake = ModuleType("taichi_tryon.simulation")
    fake.raises, fake.exit_code, fake.calls = None, 0, []

    def run_scene(scene, output, **options):
        fake.calls.append((scene, output, options))
        if fake.raises:
            raise fake.raises
        options["progress"]("drape", 0.5, "t = 0.5 s")
        return SimpleNamespace(status="settled", reason="residual 0.009", exit_code=fake.exit_code, output=output)

    fake.run_scene = run_scene
    fake.check_scene = lambda scene: [f"{scene.scene}: 1000 vertices", "skipped: nothing"]
    fake.view_scene = lambda scene, **options: fake.calls.append((scene, options))
    monkeypatch.setitem(sys.modules, "taichi_tryon.simulation", fake)
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
    assert simulation.calls[0][1] == {"arch": "cpu"}


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


def test_help_is_quick_to_load():
    code = "import sys; from taichi_tryon.cli import main\ntry: main(['--help'])\nfinally: print(*sys.modules)"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not {"taichi", "numpy", "scipy", "matplotlib", "pydantic"} & set(result.stdout.split())


def test_module_is_the_command():
    result = subprocess.run([sys.executable, "-m", "taichi_tryon", "run"], capture_output=True, text=True)
    assert result.returncode == 2 and "taichi-tryon run" in result.stderr
