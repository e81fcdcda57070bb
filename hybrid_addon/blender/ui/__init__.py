"""Properties, panels, operators, and the words in them."""
