"""Preiner 2012: times of the neighbourhood search, fits against the truth, pictures; then and now."""
