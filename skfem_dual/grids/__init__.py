"""Stage 1: partition. Dual grids of triangulations (sections 2 and 3 of the paper)."""
