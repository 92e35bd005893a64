"""Bounds by branch and bound over the tube (docs/theory.md section 9)."""
