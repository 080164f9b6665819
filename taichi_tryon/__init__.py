"""Virtual try-on: how a garment of a measured fabric hangs on a body."""

import os
import time

__version__ = "0.1.0"

STARTED = time.perf_counter()
"""About when the program started: this package is imported before all its modules."""

# Taichi prints a banner when it is imported, unless this is set before.
os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")
# For a BLAS that is loaded only now; see ``blas``.
os.environ["OPENBLAS_NUM_THREADS"] = "1"
