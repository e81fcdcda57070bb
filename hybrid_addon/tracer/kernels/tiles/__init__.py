# SPDX-License-Identifier: GPL-3.0-or-later
"""Tiles: the whole wave loop of some hundred samples in one compiled function that holds no lock."""
