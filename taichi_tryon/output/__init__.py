"""What a run leaves behind: frames, pictures' film, report, checkpoint. Reads plain arrays and knows no solver."""
