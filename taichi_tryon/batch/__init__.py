"""Many scenes, or a sweep of one: each drape in a folder and a process of its own, and one table of all."""
