"""Pyramidal projection of samples: a picture at several sizes, the holes of one filled from the next."""
