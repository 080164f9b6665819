"""Workers of a Dask cluster in place of local ones: https://distributed.dask.org."""

from __future__ import annotations

import uuid
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager

from taichi_tryon.batch.drape import Stop
from taichi_tryon.errors import InputError

# seconds that a scheduler has to answer
CONNECT = 10.0


@contextmanager
def cluster(address: str) -> Iterator[tuple[Executor, Stop]]:
    """An executor on the cluster whose scheduler is at ``address``, and an event that its workers see.

    Workers need this package and see the output folder under the same path. What a lost worker had is given to another.
    Raises InputError where Dask is not installed or no scheduler answers.
    """
    try:
        from distributed import Client, Event
    except ImportError:
        raise InputError("--scheduler: needs Dask; pip install 'taichi-tryon[cluster]'") from None
    try:
        client = Client(address, timeout=CONNECT, set_as_default=False)
    except (OSError, ValueError) as fault:
        reason = str(fault).splitlines()[0] if str(fault) else type(fault).__name__
        raise InputError(
            f"--scheduler {address}: no scheduler answers: {reason}; start one with: dask scheduler"
        ) from None
    with client:
        yield client.get_executor(), Event(f"taichi-tryon-{uuid.uuid4().hex}", client=client)
