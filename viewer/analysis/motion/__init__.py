"""Rigid motion of a subject, such as of the head, found from a region that keeps its shape."""
