"""`visup task`: check, format, show and simulate task files, and serve them to editors."""
