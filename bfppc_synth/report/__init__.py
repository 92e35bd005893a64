"""report.json, report.html, README.md and trajectory.csv: this room computes nothing."""
