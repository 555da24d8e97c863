"""The report of a benchmark: rows of results, plots, pictures, one page."""
