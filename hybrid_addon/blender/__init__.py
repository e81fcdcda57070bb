"""The room where Blender lives: properties, panels, pipeline, render engine, and the translator in sync/."""
