# SPDX-License-Identifier: GPL-3.0-or-later
"""From a scene to what rays need: checks, tables, and what this scene does without."""
