"""What ray traced objects do to EEVEE's half: shadows and caustics."""
