"""What a run leaves behind: frames, pictures, film, report, checkpoint. It reads plain arrays and knows no solver."""
