# SPDX-License-Identifier: GPL-3.0-or-later
"""What happens where a ray hits: the surface there, light that reaches it, and the rays that leave it."""
