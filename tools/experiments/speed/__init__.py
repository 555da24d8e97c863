"""How fast pictures are drawn, without a window."""
