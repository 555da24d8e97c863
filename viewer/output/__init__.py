"""Pictures and films as files, and the marks over them."""
