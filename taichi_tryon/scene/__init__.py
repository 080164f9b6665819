"""The YAML input: read with line and column, its parts put together, every fault named at once."""
