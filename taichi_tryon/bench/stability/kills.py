"""A run that is killed again and again loses nothing that it had finished, and ends as if it had been left alone.

A sheet falls onto a ball in a process of its own, which is killed (SIGKILL) at moments drawn evenly from the time that
the whole run takes; each time it goes on from its checkpoint, or starts anew where there was none yet. After every
kill all frames that had been finished must be there, equal to those of the uninterrupted run to the last bit; in the
end so must be all that was written. A run that ends before its moment is compared too, and another one is begun.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from taichi_tryon.bench.record import Record, counted
from taichi_tryon.bench.simulate import scene_path
from taichi_tryon.bench.stability.processes import end, start

SCENE = "drop_on_sphere.yaml"
OVERRIDES = ("mesh.edge_length_mm=100", "drape.duration_s=3", "output.frames_per_s=60", "output.checkpoint_s=0.1",
             "solver.threads=1")  # fmt: skip
LOST = ("frames_lost", "frames_that_differ", "resumptions_refused", "results_that_differ")
# what a run says of itself differs from run to run
OF_THE_RUN = ("report.json", "log.txt")


def records(quick: bool) -> Iterator[Record]:
    begin, kills = time.perf_counter(), 5 if quick else 20
    counts = dict.fromkeys(("kills", "resumed", "started_anew", "frames_checked", *LOST), 0)
    rng = np.random.default_rng(0)
    scene = scene_path(SCENE).absolute()
    with TemporaryDirectory() as folder:
        whole, parts = Path(folder) / "whole", Path(folder) / "parts"
        end(_start(scene, whole), whole)  # the kernels are compiled
        shutil.rmtree(whole)
        since = time.perf_counter()
        end(_start(scene, whole), whole)
        whole_s = time.perf_counter() - since
        seen: set[str] = set()
        while counts["kills"] < kills:
            resume = (parts / "checkpoint.npz").exists()
            process = _start(scene, parts, *["--resume"] * resume)
            counts["resumed" if resume else "started_anew"] += 1
            try:
                code = process.wait(rng.uniform(0, whole_s))
            except subprocess.TimeoutExpired:
                process.kill()
                process.communicate()
                counts["kills"] += 1
                found = set(frames(parts))
                counts["frames_lost"] += len(seen - found)
                counts["frames_checked"] += len(found)
                counts["frames_that_differ"] += sum(differs(whole, parts, f"frames/{name}") for name in found)
                seen |= found
                continue
            counts["resumptions_refused"] += code != 0
            counts["results_that_differ"] += bool(differing(whole, parts))
            shutil.rmtree(parts, ignore_errors=True)
            seen = set()
        resume = (parts / "checkpoint.npz").exists()
        end(_start(scene, parts, *["--resume"] * resume), parts)
        counts["results_that_differ"] += bool(differing(whole, parts))
    yield from counted("kills", counts, LOST, time.perf_counter() - begin)


def frames(folder: Path) -> list[str]:
    """Names of the finished frames."""
    return sorted(path.name for path in folder.glob("frames/[a-z]*.vtu"))


def differing(one: Path, other: Path) -> list[str]:
    """What two output folders do not have alike: files by their bytes, checkpoints by their arrays, reports by the
    figures of the result."""
    names = {str(path.relative_to(folder)) for folder in (one, other) for path in folder.rglob("*") if path.is_file()}
    found = [name for name in sorted(names - {*OF_THE_RUN, "checkpoint.npz"}) if differs(one, other, name)]
    found += ["checkpoint.npz"] * (_state(one) != _state(other))
    return found + ["report.json"] * (_result(one) != _result(other))


def differs(one: Path, other: Path, name: str) -> bool:
    """Whether a file is not in both folders, or not the same."""
    paths = one / name, other / name
    return not all(path.is_file() for path in paths) or paths[0].read_bytes() != paths[1].read_bytes()


def _state(folder: Path) -> dict[str, bytes]:
    with np.load(folder / "checkpoint.npz") as state:
        return {name: state[name].tobytes() for name in state.files}


def _result(folder: Path) -> dict:
    report = json.loads((folder / "report.json").read_text())
    run = {key: value for key, value in report["run"].items() if key != "step_ms"}
    return {"run": run, **{key: report[key] for key in ("status", "mesh", "quality", "garments", "holds")}}


def _start(scene: Path, output: Path, *options: str) -> subprocess.Popen:
    return start(scene, output, *options, *(part for override in OVERRIDES for part in ("--set", override)))
