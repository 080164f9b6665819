"""The process of one drape: the command line, which ends at once when the process that started it is gone."""

from __future__ import annotations

import os
import sys
import threading

from taichi_tryon import cli


def end_with_parent() -> None:
    """Wait for the end of standard input: the parent holds the other end, and whatever kills it lets go.

    Without this, the drape of a killed worker would go on beside the same drape started anew elsewhere. Files are
    replaced whole, so that nothing needs to be finished.
    """
    os.read(0, 1)
    os._exit(1)


if __name__ == "__main__":
    threading.Thread(target=end_with_parent, daemon=True).start()
    cli.main(sys.argv[1:])
