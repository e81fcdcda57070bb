# SPDX-License-Identifier: GPL-3.0-or-later
"""The wave loop, and those who watch it."""
