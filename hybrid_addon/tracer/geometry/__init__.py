# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes as triangles, their instances, subdivision, and the search trees over them. Only `embree` talks to Embree."""
