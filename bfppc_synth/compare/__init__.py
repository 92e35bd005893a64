"""Other methods on the plant of a folder, each tuned by the same search: ``compare DIR``."""
