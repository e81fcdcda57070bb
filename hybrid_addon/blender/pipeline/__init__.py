# SPDX-License-Identifier: GPL-3.0-or-later
"""What a hybrid scene has that a plain one has not: set up, kept in step, taken away again."""
