"""Programs for developers: a check of the set-up, mutation testing, the builder of the built-in head, long trials."""
