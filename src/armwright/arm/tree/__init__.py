"""Trees of links and joints, as files have them: the chain in one, its axes as frames, and its arm."""
