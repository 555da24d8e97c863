"""The virtual scanner: range images of meshes and shapes, with the faults that real ones have."""
