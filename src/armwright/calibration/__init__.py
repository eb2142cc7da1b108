"""A better arm from measured points: which of its parameters a measurement tells, what they are, and how well."""
