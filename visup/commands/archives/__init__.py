"""Commands about many runs: lakes are filled (`archive`), and asked."""
