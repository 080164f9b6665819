"""Dressing: disks on the body, ruled surfaces between them, panels laid on these (paper, section 5)."""
