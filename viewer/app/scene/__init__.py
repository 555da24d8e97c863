"""The 3D view: its picture, how the camera moves, and what lies over it."""
