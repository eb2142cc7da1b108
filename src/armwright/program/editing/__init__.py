"""Working on a program text: layout, repairs, and what an editor wants to know of a place in it."""
