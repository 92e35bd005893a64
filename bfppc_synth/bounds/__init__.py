"""Bounds on signals and on everything that happens on Omega (docs/theory.md sections 2, 3)."""
