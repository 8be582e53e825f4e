"""Compilation and threads of hot loops."""
