"""Plain sheets of cloth, without pattern and dressing: meshed as asked, and started where they are placed."""
