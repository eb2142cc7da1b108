"""Records: variables of named fields, laid out as one variable for each field before names are checked."""
