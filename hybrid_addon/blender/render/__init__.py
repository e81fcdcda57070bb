# SPDX-License-Identifier: GPL-3.0-or-later
"""One render: the engine, EEVEE's half, the results, and what a retrace needs."""
