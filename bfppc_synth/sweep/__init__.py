"""Certified trade-off curves: the same plant file with other numbers, point by point."""
