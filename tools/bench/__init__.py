# SPDX-License-Identifier: GPL-3.0-or-later
"""`make bench`: what the tracer and the hybrid pipeline cost, each figure beside the one that it is compared with.

python -m tools.bench [--only PART ...] [--quick] [--limit SECONDS] [--output DIR]

measure.py   side by side medians, the time limit, this machine
table.py     tables and goals -> text, Markdown, JSON
files.py     the sample scenes: opened, rendered by Blender, or translated for the tracer alone
models.py    scenes of plain data
parts        thesis, hybrid, speed (rays and threads), scaling, cycles, povray
"""
