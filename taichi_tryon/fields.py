"""Small helpers between NumPy arrays and Taichi fields, and sums that give the same bits in every run."""

import numpy as np
import taichi as ti

CHUNKS = 64


def scalars(values: np.ndarray):
    """Field (n,) filled with ``values``; integers become i32, floats the run's precision."""
    values = _cast(values)
    field = ti.field(_TYPES[values.dtype.kind], shape=max(len(values), 1))
    if len(values):
        field.from_numpy(values)
    return field


def vectors(values: np.ndarray):
    """Vector field (n,) of ``values`` (n, k)."""
    values = _cast(values)
    field = ti.Vector.field(values.shape[1], _TYPES[values.dtype.kind], shape=max(len(values), 1))
    if len(values):
        field.from_numpy(values)
    return field


def upload(field, values: np.ndarray):
    """Copy an array into a field of the run's precision."""
    field.from_numpy(_cast(values))


def _cast(values: np.ndarray) -> np.ndarray:
    """Integers as i32, floats in the run's precision: Taichi warns at every other width."""
    values = np.ascontiguousarray(values)
    if values.dtype.kind in "iub":
        return values.astype(np.int32)
    return values.astype(np.float32 if ti.lang.impl.get_runtime().default_fp == ti.f32 else np.float64)


_TYPES = {"i": ti.i32, "f": float}


def group(owner: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Table for gathering: entries of owner o are ``order[start[o]:start[o + 1]]``, in their given order."""
    order = np.argsort(owner, kind="stable")
    start = np.zeros(count + 1, dtype=np.int64)
    np.cumsum(np.bincount(owner, minlength=count), out=start[1:])
    return start.astype(np.int32), order.astype(np.int32)


@ti.func
def chunk_bounds(chunk: int, count: int):
    """First and last-but-one index of a chunk; a fixed division of the work keeps sums in the same order."""
    return chunk * count // CHUNKS, (chunk + 1) * count // CHUNKS
