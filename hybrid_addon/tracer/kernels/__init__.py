# SPDX-License-Identifier: GPL-3.0-or-later
"""Compiled twins (numba) of hot numpy functions, and what loads them in the background."""
