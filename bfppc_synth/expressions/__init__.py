"""The user's mathematics: grammar, exact constants, and the step into sympy."""
