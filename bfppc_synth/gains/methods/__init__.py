"""The inequalities of each theorem, one file each."""
