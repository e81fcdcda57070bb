"""From samples to pixels: what a sample gathers, the pixel filter, and the picture."""
