"""Landmarks whose true paths are known, how well Scan4D tracks and measures them."""
