"""Why there is no design, and what would suffice: each suggestion is a certified design."""
