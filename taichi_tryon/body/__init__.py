"""The wearer: fused metaballs on a skeleton, their density as the paper's eqs. 1 to 3, poses and motion."""
