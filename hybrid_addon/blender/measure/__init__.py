# SPDX-License-Identifier: GPL-3.0-or-later
"""`hybrid report` and `hybrid stability` in Blender, and Cycles beside them."""
