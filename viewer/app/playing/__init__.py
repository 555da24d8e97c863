"""Playing a scan: which frame is due, which pose is there, the bar at the bottom."""
