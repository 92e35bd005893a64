"""The untrusted search for gains: a log-space program, its solution, and safe rounding."""
