"""Which points an eye sees, found without normals or faces: hidden point removal (Katz 2007)."""
