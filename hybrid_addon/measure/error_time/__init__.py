"""Error against run time: renders, errors, the front, and its page."""
