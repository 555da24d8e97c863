"""What backends are judged by: scenes, error, run time."""
