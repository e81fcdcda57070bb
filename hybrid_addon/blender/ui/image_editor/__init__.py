# SPDX-License-Identifier: GPL-3.0-or-later
"""What the Image Editor shows of a hybrid picture: its parts, a wipe between them, why a pixel is as it is."""
