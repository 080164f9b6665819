"""Virtual try-on: how a garment of a measured fabric hangs on a body."""

__version__ = "0.1.0"
