"""From a scene to what rays need: checks, tables, and what this scene does without."""
