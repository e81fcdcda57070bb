"""The wave loop, and those who watch it."""
