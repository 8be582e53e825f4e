"""How a loaded cell is integrated."""
