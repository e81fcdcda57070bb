"""What rays are inside of: nested solids, which meshes are solids, faces that touch."""
