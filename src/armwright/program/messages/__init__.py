"""What is said about a program: diagnostics, and how people and tools read them."""
