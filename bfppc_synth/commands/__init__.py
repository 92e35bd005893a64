"""One module a command: its options, its work, its exit code; cli.py lists them."""
