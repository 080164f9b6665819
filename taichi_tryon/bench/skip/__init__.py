"""What leaving out saves: the same scene with and without, and the same result."""
