"""Stage 3, postprocessing: two solutions on dual grids, one better field."""
