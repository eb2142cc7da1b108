"""Program mode: an RLO program, with its control flow, in the words of no controller."""
