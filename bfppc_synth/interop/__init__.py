"""What a certified design looks like to other tools."""
