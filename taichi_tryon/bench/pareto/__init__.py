"""Error against time: scenes run with many settings, and held against our own converged solution."""
