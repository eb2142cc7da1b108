"""What it takes to move an arm, and how it moves when it is pushed."""
