"""Files at the border: reading what people write, with the line of every key, and writing results whole or not at all."""
