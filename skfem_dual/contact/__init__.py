"""What is solved: bodies on the ground, loads, contact that is found."""
