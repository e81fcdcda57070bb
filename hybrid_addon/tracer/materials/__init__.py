"""Tables of what surfaces are: inputs that vary, Principled layers, albedo tables, textures."""
