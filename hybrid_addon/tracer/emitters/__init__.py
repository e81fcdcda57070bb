# SPDX-License-Identifier: GPL-3.0-or-later
"""What light comes from: lamps, the world, and EEVEE's own pixels."""
