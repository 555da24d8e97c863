"""Faces between points: triangle meshes, and the rays that hit them."""
