"""The virtual machine: it interprets intermediate code over a simulated cell, and records what happens."""
