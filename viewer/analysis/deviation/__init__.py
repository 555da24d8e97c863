"""How far the points of a frame lie from a reference surface, and on which side."""
