"""Pictures, recordings and films that the user takes in the window."""
