"""Stage 2: boundary elements. Rigid punches on elastic substrates (section 4 of the paper)."""
