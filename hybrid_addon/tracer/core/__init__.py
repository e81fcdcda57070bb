# SPDX-License-Identifier: GPL-3.0-or-later
"""Vectors, constants, rays, cameras, random numbers, counters, and the cache that leaves one frame to the next."""
