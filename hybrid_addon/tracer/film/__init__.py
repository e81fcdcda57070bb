# SPDX-License-Identifier: GPL-3.0-or-later
"""From samples to pixels: what a sample gathers, the pixel filter, and the picture."""
