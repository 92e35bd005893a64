"""The closed loop in C: the generated controller and the plant, built where it runs."""
