"""Exact cases: each module is one, says where its reference comes from, and has ``records(quick)``."""
