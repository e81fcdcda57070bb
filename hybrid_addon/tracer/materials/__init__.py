# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables of what surfaces are: inputs that vary, Principled layers, albedo tables, textures."""
