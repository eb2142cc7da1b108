"""Where the hand is for given joint positions, how it moves, and which joint positions put it somewhere."""
