"""How exactly Scan4D finds the rigid motion of a head, beside other registrations."""
