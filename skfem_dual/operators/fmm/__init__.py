"""The fast multipole method."""
