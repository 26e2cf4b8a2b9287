"""Programs for developers: a check of the set-up, mutation testing, and the builder of the built-in head."""
