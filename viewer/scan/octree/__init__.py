"""Sparse voxel octrees (Slomp 2014, VI): built of points, cut by what a view can tell apart. Know no GL."""

from .octree import DEEPEST, Attributes, Octree

__all__ = ["DEEPEST", "Attributes", "Octree"]
