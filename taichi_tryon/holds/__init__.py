"""Parts of garments that are held fixed or led along a path, as clamps and pins do."""
