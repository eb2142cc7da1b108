"""Files at the border: reading what people write, writing results whole or not at all."""
