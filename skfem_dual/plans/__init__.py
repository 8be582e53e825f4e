"""Outlines of plans: corners and drawings in, meshes and answers out."""
