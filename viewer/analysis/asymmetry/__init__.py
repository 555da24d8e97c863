"""How far a subject differs from its mirror image, and the plane that mirrors it."""
