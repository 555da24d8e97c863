"""Farooq 2013: hole filling by levels, hidden points, speed on large views, playing; then and now."""
