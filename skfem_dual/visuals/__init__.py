"""Drawing grids, fields and isobars with pyvista or matplotlib."""
