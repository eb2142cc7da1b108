"""How an arm moves under its drives: the plant, its controllers, the integration over time and what comes of it."""
