"""From a pattern to a sewn triangle mesh: edges sampled alike along seams, panels triangulated, vertices welded."""
