"""Programs at work: processes, motions, effects, and what a run leaves."""
