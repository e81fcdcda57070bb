"""Which samples are traced, when, and where they stop."""
