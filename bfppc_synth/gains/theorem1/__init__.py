"""The search for Theorem 1: its problem, its judge, its rounding."""
