"""Writers: the statements of a controller in its language."""
