"""The audit of gains that somebody has chosen: every inequality, both forms, then simulations."""
