"""What developers run: checks of the set-up, mutants, and the builder of the built-in head."""
