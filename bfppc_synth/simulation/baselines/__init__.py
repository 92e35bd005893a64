"""Other control methods on the same plant, for a fair comparison (docs/theory.md section 11)."""
