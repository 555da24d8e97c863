"""How well landmarks are tracked: scans of known motion, no two frames with the same points."""
