"""Model databases that are corrupted (`robustness`, `corrupt`) or grown (`scale`, `augment`)."""
