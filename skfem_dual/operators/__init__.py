"""How the matrix of settlements is applied."""
