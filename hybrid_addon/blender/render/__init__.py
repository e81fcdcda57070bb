"""One render: the engine, EEVEE's half, the results, and what a retrace needs."""
