"""Finding and opening scans: the dialog, the lists, what is dropped onto the window."""
