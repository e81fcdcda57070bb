# SPDX-License-Identifier: GPL-3.0-or-later
"""What ray traced objects do to EEVEE's half: shadows and caustics."""
