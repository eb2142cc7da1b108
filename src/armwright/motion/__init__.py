"""How an arm goes from here to there: profiles in time, paths in space, and what they ask of the joints."""
