"""``python -m taichi_tryon``: the same as the console script."""

from taichi_tryon.cli import main

main()
