"""Small helpers between NumPy arrays and Taichi fields, and sums that give the same bits in every run."""

import numpy as np
import taichi as ti

CHUNKS = 64


def scalars(values: np.ndarray, dtype=None):
    """Field (n,) filled with ``values``; integers become i32, floats the run's precision unless ``dtype`` is given."""
    values = np.ascontiguousarray(values)
    field = ti.field(dtype or (ti.i32 if values.dtype.kind in "iub" else float), shape=max(len(values), 1))
    if len(values):
        field.from_numpy(values.astype(np.int32 if values.dtype.kind in "iub" else np.float64))
    return field


def vectors(values: np.ndarray, dtype=None):
    """Vector field (n,) of ``values`` (n, k)."""
    values = np.ascontiguousarray(values)
    integer = values.dtype.kind in "iub"
    field = ti.Vector.field(values.shape[1], dtype or (ti.i32 if integer else float), shape=max(len(values), 1))
    if len(values):
        field.from_numpy(values.astype(np.int32 if integer else np.float64))
    return field


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
