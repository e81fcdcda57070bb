# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts of docs/ that programs write.

python -m tools.pages            what comes from the code: settings, presets, the plan's table (`make pages`)
python -m tools.pages.stability  the tables of docs/stability.md (`make stability`)

blocks.py     where such parts lie in a page
from_code.py  tables of properties, presets and prunings
"""
