"""Sewing patterns: panels with named edges, seams and darts, as they are written in YAML, checked and drawn."""
