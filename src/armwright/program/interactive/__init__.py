"""Programs that are entered piece by piece: each statement is done at once, and can be taken back."""
