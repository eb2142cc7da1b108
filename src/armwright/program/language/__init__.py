"""What every stage of the compiler knows: words, kinds of variables, names, units, source texts, diagnostics."""
