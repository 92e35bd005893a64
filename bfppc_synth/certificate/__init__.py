"""Proofs: the separate checker and the search that feeds it."""
