"""The plant file: all distrust of user text lives here."""
