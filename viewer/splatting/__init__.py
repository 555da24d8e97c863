"""What several backends draw with: points as squares, discs and cubes, by every way of instancing."""
