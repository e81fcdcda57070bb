# SPDX-License-Identifier: GPL-3.0-or-later
"""Which samples are traced, when, and where they stop."""
