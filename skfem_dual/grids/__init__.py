"""Partition: dual grids of triangulations (sections 2 and 3 of the paper)."""
