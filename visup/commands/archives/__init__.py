"""Commands about many runs: filling lakes (`archive`), and querying them."""
