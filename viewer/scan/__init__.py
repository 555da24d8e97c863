"""What a scan is: points, poses, timelines and the files they come from. Knows no GL."""
