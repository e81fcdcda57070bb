# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m tools.pages`: write what comes from the code."""

import hybrid_addon

from . import blocks, from_code

hybrid_addon.register()
blocks.write(from_code.SETTINGS, from_code.settings_blocks())
blocks.write(from_code.PLAN, from_code.plan_blocks())
