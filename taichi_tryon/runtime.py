"""The only place that starts Taichi, and what it says of the device it got."""

from __future__ import annotations

import ctypes
import io
import os
import sys
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import taichi as ti

from taichi_tryon import blas, kernel_launches, kernel_loops, kernel_sources
from taichi_tryon.errors import InputError

# before the modules with kernels are read
kernel_sources.read_faster()
kernel_launches.launch_faster()
kernel_loops.stay_on_the_thread()


@dataclass(frozen=True)
class Device:
    """What the run computes on, as the report states it."""

    arch: str
    precision: str
    threads: int


def default_cache() -> Path:
    """Folder of the compiled kernels, so that a second start is a warm one."""
    base = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
    return base / "taichi_tryon" / "kernels"


def start(
    arch: str | None = None,
    precision: str = "f64",
    threads: int | None = None,
    cache: Path | None = None,
    offline_cache: bool = True,
    profile: bool = False,
) -> Device:
    """Start (or restart) Taichi on ``arch`` ("cpu", "cuda", or None: cuda if it starts, else cpu).

    All Taichi fields made before are gone afterwards. Raises InputError where CUDA is asked for and does not start:
    Taichi itself would fall back without an error. What ran before goes on then. Without ``threads``, as many as
    OMP_NUM_THREADS says, else as there are cores. profile: Taichi's kernel profiler.
    """
    blas.stay_on_one_thread()
    threads = threads or _default_threads()
    with_cuda = arch != "cpu" and _cuda_starts()
    if arch == "cuda" and not with_cuda:
        raise InputError("--arch cuda: no CUDA device starts on this machine; leave --arch out or use --arch cpu")
    options = dict(
        default_fp=ti.f64 if precision == "f64" else ti.f32,
        cpu_max_num_threads=threads,
        random_seed=0,
        fast_math=False,
        # a third of the compiler's work, and LLVM does the same again: same bits, same speed on a CPU
        cfg_optimization=with_cuda,
        log_level=ti.WARN,
        offline_cache=offline_cache,
        offline_cache_file_path=str(cache or default_cache()),
        kernel_profiler=profile,
    )
    # Taichi prints the device; stdout belongs to our own results.
    with redirect_stdout(io.StringIO()):
        ti.init(arch=ti.cuda if with_cuda else ti.cpu, **options)
    got = "cuda" if ti.cfg.arch == ti.cuda else "cpu"
    kernel_loops.started(everything=got != "cpu", threads=threads)
    return Device(arch=got, precision=precision, threads=threads)


def _default_threads() -> int:
    """As other programs read it; a batch that runs several processes at a time gives each its share so."""
    asked = os.environ.get("OMP_NUM_THREADS", "").partition(",")[0].strip()
    return int(asked) if asked.isdecimal() and int(asked) else len(os.sched_getaffinity(0))


def _cuda_starts() -> bool:
    """Whether CUDA is there, asked without ti.gpu, which would silently take Vulkan on a software driver.

    The driver is asked before Taichi: Taichi warns where there is none, and does not count the devices.
    """
    try:
        driver = ctypes.CDLL("nvcuda.dll" if sys.platform == "win32" else "libcuda.so")  # as Taichi names it
    except OSError:
        return False
    devices = ctypes.c_int(0)
    there = driver.cuInit(0) == 0 and driver.cuDeviceGetCount(ctypes.byref(devices)) == 0 and devices.value > 0
    return there and bool(ti._lib.core.with_cuda())
