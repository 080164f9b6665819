"""Small helpers between NumPy arrays and Taichi fields, and sums that give the same bits in every run."""

import ctypes
import os

import numpy as np
import taichi as ti

CHUNKS = 1024
"""Parts that sums are made of. Taichi gives a CPU thread 512 turns of a loop at least: fewer would stay on one."""
LEAST_TURNS = 512


class Tables:
    """Fields made from arrays; ``fill`` copies all the values at once.

    Taichi builds a kernel for every field that it fills by itself, which costs more than the values do.
    """

    def __init__(self):
        self._sources = {"i": [np.zeros(1, np.int32)], "f": [cast(np.zeros(1))]}
        self._entries = []

    def scalars(self, values: np.ndarray):
        """Field (n,) for ``values``; integers become i32, floats the run's precision."""
        values = cast(values)
        return self._add(ti.field(_TYPES[values.dtype.kind], shape=max(len(values), 1)), values)

    def vectors(self, values: np.ndarray):
        """Vector field (n,) for ``values`` (n, k)."""
        values = cast(values)
        field = ti.Vector.field(values.shape[1], _TYPES[values.dtype.kind], shape=max(len(values), 1))
        return self._add(field, values)

    def matrices(self, values: np.ndarray):
        """Matrix field (n,) for ``values`` (n, k, m)."""
        values = cast(values)
        return self._add(ti.Matrix.field(*values.shape[1:], _TYPES[values.dtype.kind], shape=len(values)), values)

    def set(self, field, values: np.ndarray):
        """Let a field (n,) that is there already take ``values`` too."""
        self._add(field, cast(values))

    def _add(self, field, values):
        sources = self._sources[values.dtype.kind]
        start = sum(map(len, sources))
        self._entries.append((field, values.dtype.kind, values.shape[1:], start, len(values)))
        sources.append(values.ravel())
        return field

    def fill(self):
        """Copy the values into the fields: first all integers, then all floats, which takes less memory at a time."""
        for kind in "if":
            entries = tuple(entry[:1] + entry[2:] for entry in self._entries if entry[1] == kind)
            if entries:
                self._copy(entries, self._sources.pop(kind))
        _give_back()

    def _copy(self, entries: tuple, sources: list[np.ndarray]):
        @ti.kernel
        def copy(longest: int, source: ti.types.ndarray()):
            for i in range(longest):
                for field, shape, start, count in ti.static(entries):
                    if i < count:
                        if ti.static(len(shape) == 0):
                            field[i] = source[start + i]
                        elif ti.static(len(shape) == 1):
                            for k in range(shape[0]):
                                field[i][k] = source[start + i * shape[0] + k]
                        else:
                            for k in range(shape[0]):
                                for m in range(shape[1]):
                                    field[i][k, m] = source[start + (i * shape[0] + k) * shape[1] + m]

        # compiled on nothing: what a kernel was compiled on lives until Python collects its garbage
        copy(0, sources[0])
        copy(max(entry[-1] for entry in entries), _joined(sources))


def _joined(parts: list[np.ndarray]) -> np.ndarray:
    """The arrays one after the other; each is let go as soon as it has been copied."""
    whole = np.empty(sum(map(len, parts)), parts[0].dtype)
    end = len(whole)
    while parts:
        part = parts.pop()
        whole[end - len(part) : end] = part
        end -= len(part)
    return whole


def _give_back():
    """Return to the system what arrays have let go: glibc keeps it, a tenth of what a large cloth takes."""
    if hasattr(_libc, "malloc_trim"):
        _libc.malloc_trim(0)


_libc = ctypes.CDLL(None) if os.name == "posix" else None


def upload(field, values: np.ndarray):
    """Copy an array into a field of the run's precision."""
    field.from_numpy(cast(values))


def cast(values: np.ndarray) -> np.ndarray:
    """Integers as i32, floats in the run's precision, copied where they are not: Taichi warns at every other width."""
    values = np.ascontiguousarray(values)
    if values.dtype.kind in "iub":
        return values.astype(np.int32, copy=False)
    single = ti.lang.impl.get_runtime().default_fp == ti.f32
    return values.astype(np.float32 if single else np.float64, copy=False)


_TYPES = {"i": ti.i32, "f": float}


def group(owner: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Table for gathering: entries of owner o are ``order[start[o]:start[o + 1]]``, in their given order."""
    order = np.argsort(owner, kind="stable")
    start = np.zeros(count + 1, dtype=np.int64)
    np.cumsum(np.bincount(owner, minlength=count), out=start[1:])
    return start.astype(np.int32), order.astype(np.int32)


def sums(columns: int) -> np.ndarray:
    """Where a kernel puts the sums (CHUNKS, columns) of the chunks: an array, which costs no kernel to read."""
    return np.zeros((CHUNKS, columns))


@ti.func
def chunk_bounds(chunk: int, count: int):
    """First and last-but-one index of a chunk; a fixed division of the work keeps sums in the same order."""
    turn = ti.cast(chunk, ti.i64) * count
    return ti.cast(turn // CHUNKS, ti.i32), ti.cast((turn + count) // CHUNKS, ti.i32)
