"""Cross-validation over families of sequences (`--folds`)."""
