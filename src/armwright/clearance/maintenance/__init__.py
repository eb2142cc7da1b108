"""When to measure, to correct and to change the bearings of a linkage whose pins wear."""
