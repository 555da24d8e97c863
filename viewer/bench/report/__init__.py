"""What is told of a benchmark: rows of results, plots, pictures, one page."""
