"""Self-contained pages that show what happened."""
