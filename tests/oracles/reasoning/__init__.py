"""Rules, relations and recognition against their oracles; task files that are corrupted."""
