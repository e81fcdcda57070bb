"""What measures the product: error against run time, and numerical stability. Loaded when asked for."""
