"""What stands on the ground: punches, structures, groups, under load cases and along paths."""
