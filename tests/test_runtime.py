"""Starting Taichi: which device, what is said where there is none, and nothing on the user's stdout or stderr."""

from __future__ import annotations

import ctypes
import subprocess
import sys
from types import SimpleNamespace

import pytest
import taichi as ti

from taichi_tryon import runtime
from taichi_tryon.errors import InputError


def in_a_process(code: str) -> subprocess.CompletedProcess:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)


def test_start_says_what_it_got_and_nothing_else():
    code = (
        "from taichi_tryon import runtime; import taichi as ti\n"
        "print(runtime.start('cpu', 'f32', 1, offline_cache=False), ti.cfg.default_fp == ti.f32)\n"
    )
    result = in_a_process(code)
    assert result.stdout == "Device(arch='cpu', precision='f32', threads=1) True\n"
    assert result.stderr == ""


@pytest.mark.skipif(runtime._cuda_starts(), reason="a CUDA device is here")
def test_without_arch_and_gpu_it_is_the_cpu_without_a_warning():
    code = "from taichi_tryon import runtime; print(runtime.start(offline_cache=False).arch)"
    result = in_a_process(code)
    assert (result.stdout, result.stderr) == ("cpu\n", "")


@pytest.mark.skipif(not runtime._cuda_starts(), reason="no CUDA device here")
def test_without_arch_a_gpu_is_taken():
    assert in_a_process("from taichi_tryon import runtime; print(runtime.start().arch)").stdout == "cuda\n"


def test_cuda_without_a_gpu_is_an_input_error_and_what_runs_goes_on(monkeypatch):
    field = ti.field(float, shape=())
    field[None] = 3.0
    monkeypatch.setattr(runtime, "_cuda_starts", lambda: False)
    with pytest.raises(InputError, match="--arch cuda: no CUDA device starts") as caught:
        runtime.start("cuda")
    assert caught.value.exit_code == 2 and "\n" not in str(caught.value)
    assert field[None] == 3.0


@pytest.mark.parametrize(
    ("error_of_init", "devices", "taichi_has_it", "starts"),
    [(0, 1, True, True), (0, 0, True, False), (100, 1, True, False), (0, 1, False, False)],
)
def test_cuda_starts_where_driver_device_and_taichi_agree(monkeypatch, error_of_init, devices, taichi_has_it, starts):
    def count(found):
        found._obj.value = devices
        return 0

    driver = SimpleNamespace(cuInit=lambda flags: error_of_init, cuDeviceGetCount=count)
    monkeypatch.setattr(ctypes, "CDLL", lambda name: driver)
    monkeypatch.setattr(ti._lib.core, "with_cuda", lambda: taichi_has_it)
    assert runtime._cuda_starts() is starts


@pytest.mark.parametrize(("asked", "threads"), [("3", 3), ("4,2", 4), ("", 2), ("0", 2), ("many", 2)])
def test_threads_are_as_many_as_other_programs_are_told_to_use(monkeypatch, asked, threads):
    monkeypatch.setenv("OMP_NUM_THREADS", asked)
    monkeypatch.setattr("os.sched_getaffinity", lambda pid: {4, 7})
    assert runtime._default_threads() == threads
