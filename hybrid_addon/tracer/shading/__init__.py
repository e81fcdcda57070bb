"""What happens where a ray hits: the surface there, light that reaches it, and the rays that leave it."""
