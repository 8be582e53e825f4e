"""What a solver answers: positions, pressures, bounds, envelopes, the ground below."""
