"""Wear of journals and bearings: Archard's law on their surfaces, and what it does to the tip over the life."""
