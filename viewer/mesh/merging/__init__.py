"""Range views made into one surface: what they share is found, their alignment corrected, and each patch
left to the view that sees it best (Farooq and Siebert 2009, section 4)."""
