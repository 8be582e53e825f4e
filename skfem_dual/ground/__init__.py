"""What the ground is made of."""
