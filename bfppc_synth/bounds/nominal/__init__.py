"""Bounds around center nominal (docs/theory.md section 8)."""
