"""A picture: which point each pixel shows, how far away it is, and what colour it gets."""
