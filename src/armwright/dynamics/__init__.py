"""What it takes to move an arm: the efforts at its joints."""
