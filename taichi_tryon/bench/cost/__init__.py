"""Where the time goes, and how it grows."""
