"""Monotone envelopes and majorants of the plant's functions (docs/theory.md section 1)."""
