"""Suite ``stability``: what a scene, its files and its machine may do to a run, and what the run does then."""
