"""The tables of Slomp 2014."""
