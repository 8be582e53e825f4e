"""Many problems through any executor."""
