# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m hybrid_addon VERB ...`: the command line over the bpy module (the same parser as `blender -c hybrid`)."""

from .blender.standalone import main

main()
