"""visup, the visual supervisor."""
