"""An interactive session: each statement is executed as it is entered, and can be undone."""
