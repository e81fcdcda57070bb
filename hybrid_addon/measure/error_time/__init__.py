# SPDX-License-Identifier: GPL-3.0-or-later
"""Error against run time: renders, errors, the front, and its page."""
