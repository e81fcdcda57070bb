# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties, panels, operators, and the words in them."""
