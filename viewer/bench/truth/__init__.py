"""What is truly there: scenes that rays are cast at, and reference pictures of them."""
