# SPDX-License-Identifier: GPL-3.0-or-later
"""What rays are inside of: nested solids, which meshes are solids, faces that touch."""
