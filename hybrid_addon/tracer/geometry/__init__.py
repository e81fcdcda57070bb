"""Meshes as triangles, their instances, subdivision, and the search trees over them. Only `embree` talks to Embree."""
