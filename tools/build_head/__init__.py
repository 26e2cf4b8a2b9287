"""The builder of the built-in head: a Catmull-Clark surface of a hand-typed cage, meshed and painted."""
