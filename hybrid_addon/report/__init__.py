# SPDX-License-Identifier: GPL-3.0-or-later
"""What a render cost and how exact it is: metrics, the frame report, error against run time. Pure numpy."""
