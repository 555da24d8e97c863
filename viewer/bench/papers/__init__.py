"""What papers measured, and the same here: one folder a paper."""
