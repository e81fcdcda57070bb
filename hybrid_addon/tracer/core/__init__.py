"""Vectors, constants, rays, cameras, random numbers, counters, and the cache that leaves one frame to the next."""
