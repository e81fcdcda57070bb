# SPDX-License-Identifier: GPL-3.0-or-later
"""The room where Blender lives: properties, panels, pipeline, render engine, and the translator in sync/."""
