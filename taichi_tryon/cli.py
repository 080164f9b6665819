"""The command line. Each command reads its input and calls one function; heavy imports wait until one needs them."""

from __future__ import annotations

import gc
import json
import sys
import traceback
from contextlib import nullcontext
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from taichi_tryon.errors import TryonError

if TYPE_CHECKING:
    from taichi_tryon.scene.load import Read
    from taichi_tryon.scene.models import SceneSpec

app = typer.Typer(
    name="taichi-tryon",
    help="Dress a body of metaballs in sewing patterns and let the cloth fall.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


class Arch(str, Enum):
    cpu = "cpu"
    cuda = "cuda"


class Precision(str, Enum):
    f32 = "f32"
    f64 = "f64"


ScenePath = Annotated[Path, typer.Argument(metavar="SCENE", help="YAML file of the scene")]
Overrides = Annotated[
    list[str],
    typer.Option("--set", metavar="KEY.PATH=VALUE", help="Set a value: mesh.edge_length_mm=20. Repeatable."),
]
ArchOption = Annotated[Arch | None, typer.Option(help="Device; without it, cuda where it starts, else cpu.")]
PrecisionOption = Annotated[Precision | None, typer.Option(help="Overrides the scene's solver.precision.")]
ThreadsOption = Annotated[int | None, typer.Option(min=1, help="CPU threads; overrides the scene's solver.threads.")]


@app.callback()
def _common(
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an internal error.")] = False,
) -> None:
    """Options that may stand anywhere; ``main`` reads them."""


@app.command()
def run(
    scenes: Annotated[list[Path], typer.Argument(metavar="SCENE...", help="YAML files of scenes")],
    output: Annotated[
        Path | None, typer.Option(help="Output folder; without it, outputs/<scene name>, of a batch outputs/batch.")
    ] = None,
    overrides: Annotated[
        list[str],
        typer.Option(
            "--set",
            metavar="KEY.PATH=VALUE",
            help="Set a value: mesh.edge_length_mm=20. Repeatable. A list where the key takes none (a list of lists "
            "where it takes a list) is a sweep: a run for each value, and for each choice of values of several keys.",
        ),
    ] = [],  # noqa: B006
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on from what is in the output folder; nothing finished is repeated.")
    ] = False,
    jobs: Annotated[int, typer.Option(min=1, help="Of a batch, how many to run at a time.")] = 1,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Run a batch on this Dask scheduler's workers (extra [cluster])."),
    ] = None,
    arch: ArchOption = None,
    precision: PrecisionOption = None,
    threads: ThreadsOption = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress, only the last lines.")] = False,
) -> None:
    """Run a scene and write its output folder; many scenes, or a sweep, each into a folder below it."""
    from taichi_tryon.scene.sweep import spread

    variants = spread(_with_options(overrides, precision, threads))
    if len(scenes) > 1 or variants[0].parameters or scheduler is not None:
        from taichi_tryon.batch.command import run_many

        folder = output or Path("outputs/batch")
        options = ("--arch", arch.value) if arch else ()
        raise typer.Exit(run_many(scenes, variants, folder, jobs, scheduler, options, resume=resume, quiet=quiet))
    from taichi_tryon.progress import TerminalProgress, silent
    from taichi_tryon.run import run_scene
    from taichi_tryon.scene.load import read_scene

    read = read_scene(scenes[0], variants[0].overrides)
    folder = output or Path("outputs") / read.part.scene
    with read.naming_places(), nullcontext(silent) if quiet else TerminalProgress() as progress:
        result = run_scene(read.part, folder, arch=_value(arch), resume=resume, progress=progress)
    print(*filter(None, (f"{result.status}: {result.reason}", result.advice, result.output)), sep="\n")
    raise typer.Exit(result.exit_code)


@app.command()
def check(scene: ScenePath, overrides: Overrides = []) -> None:  # noqa: B006
    """Validate everything that a run would read, build mesh and start, print their sizes; simulate nothing."""
    read = _read(scene, overrides)
    from taichi_tryon.check import check_scene

    with read.naming_places():
        print("\n".join(check_scene(read.part)))


@app.command()
def view(
    scene: ScenePath,
    overrides: Overrides = [],  # noqa: B006
    arch: ArchOption = None,
    precision: PrecisionOption = None,
    threads: ThreadsOption = None,
) -> None:
    """Run a scene in a window: drag to look around, space pauses, r starts again, Esc ends."""
    read = _read(scene, overrides, precision, threads)
    from taichi_tryon.progress import TerminalProgress
    from taichi_tryon.window import view_scene

    with read.naming_places(), TerminalProgress() as progress:
        view_scene(read.part, arch=_value(arch), progress=progress)


@app.command()
def bench(
    suite: Annotated[
        str,
        typer.Argument(
            metavar="SUITE",
            help="accuracy: exact cases; pareto: error against time; cost: where it goes; "
            "skip: what leaving out saves; stability: what a run survives",
        ),
    ],
    quick: Annotated[bool, typer.Option("--quick", help="Fewer and smaller cases, within three minutes.")] = False,
    case: Annotated[list[str], typer.Option("--case", help="Only this case of the suite. Repeatable.")] = [],  # noqa: B006
    output: Annotated[Path | None, typer.Option(help="Output folder; without it, outputs/bench.")] = None,
    peers: Annotated[bool, typer.Option("--peers", help="Run MuJoCo too (suite pareto, extra [peers]).")] = False,
) -> None:
    """Run a suite: a table here, SUITE.json and plots in the output folder."""
    from rich.console import Console

    from taichi_tryon.bench.suite import print_table, run_suite

    folder = output or Path("outputs/bench")
    finished = run_suite(suite, quick, folder, case, say=lambda line: print(line, file=sys.stderr), peers=peers)
    print_table(finished, Console(width=None if sys.stdout.isatty() else 160))
    print(folder)
    raise typer.Exit(finished.exit_code)


@app.command()
def body(
    body: Annotated[Path, typer.Argument(metavar="BODY", help="YAML file of the body")],
    pose: Annotated[Path | None, typer.Option(help="YAML file of a pose; without it, the rest pose.")] = None,
    measure: Annotated[bool, typer.Option("--measure", help="Print the girths.")] = False,
    output: Annotated[Path | None, typer.Option(help="Picture (.png) or mesh (.obj, .ply, .stl, .vtu).")] = None,
) -> None:
    """Measure, draw or mesh a body."""
    from taichi_tryon.inspection import inspect_body
    from taichi_tryon.scene.load import load_body_and_pose

    print("\n".join(inspect_body(*load_body_and_pose(body, pose), measure, output)))


@app.command()
def pattern(
    pattern: Annotated[Path, typer.Argument(metavar="PATTERN", help="YAML file of the pattern")],
    output: Annotated[Path | None, typer.Option(help="Draw the pattern: .svg or .png")] = None,
) -> None:
    """Print areas and seam lengths of a pattern, and draw it."""
    from taichi_tryon.inspection import inspect_pattern
    from taichi_tryon.pattern.spec import PatternSpec
    from taichi_tryon.scene.load import load_part

    print("\n".join(inspect_pattern(load_part(pattern, PatternSpec), output)))


@app.command()
def schema(
    markdown: Annotated[bool, typer.Option("--markdown", help="Tables for readers instead of JSON Schema.")] = False,
) -> None:
    """Print the JSON Schema of a scene file."""
    from taichi_tryon.scene import schema as scene_schema

    text = scene_schema.markdown() if markdown else json.dumps(scene_schema.json_schema(), indent=2) + "\n"
    sys.stdout.write(text)


def _read(
    path: Path, overrides: list[str], precision: Precision | None = None, threads: int | None = None
) -> Read[SceneSpec]:
    from taichi_tryon.scene.load import read_scene

    return read_scene(path, _with_options(overrides, precision, threads))


def _with_options(overrides: list[str], precision: Precision | None, threads: int | None) -> list[str]:
    """Overrides, and after them the options that set a value of the scene."""
    options = {"precision": _value(precision), "threads": threads}
    return [*overrides, *(f"solver.{key}={value}" for key, value in options.items() if value)]


def _value(choice: Enum | None) -> str | None:
    return choice.value if choice else None


def main(arguments: list[str] | None = None) -> None:
    """Run a command and end the process: 0 done, 2 input at fault, 3 failed, 130 interrupted."""
    arguments = sys.argv[1:] if arguments is None else arguments
    # imports and kernels make millions of objects that stay: looking through them for garbage is a tenth of the start
    gc.set_threshold(100_000)
    debug = "--debug" in arguments
    try:
        app([argument for argument in arguments if argument != "--debug"], prog_name="taichi-tryon")
    except TryonError as error:
        print(error, file=sys.stderr)
        sys.exit(error.exit_code)
    except KeyboardInterrupt:
        sys.exit(130)
    except Exception as error:
        if debug:
            traceback.print_exc()
        else:
            print(f"internal error: {type(error).__name__}: {error} (--debug shows where)", file=sys.stderr)
        sys.exit(3)
