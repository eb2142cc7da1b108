"""Data-flow analysis without numbers: what the statements do to frames, arms and processes along every path."""
