# SPDX-License-Identifier: GPL-3.0-or-later
"""What measures the product: error against run time, and numerical stability. Loaded when asked for."""
