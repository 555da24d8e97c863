"""Maršík 2010: code words beside discs and points, in time and in what is shown."""
