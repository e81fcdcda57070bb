"""`hybrid report` and `hybrid stability` in Blender, and Cycles beside them."""
