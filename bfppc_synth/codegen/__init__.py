"""Design and certificate -> law -> controller.py, C99 and the output folder."""
