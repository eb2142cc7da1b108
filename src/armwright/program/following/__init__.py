"""What the statements of a program do to frames, hands and processes, followed without any numbers."""
