"""What all renderers do on the same scenes, and what single settings of one do."""
