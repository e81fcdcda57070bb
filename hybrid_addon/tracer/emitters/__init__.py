"""What light comes from: lamps, the world, and EEVEE's own pixels."""
