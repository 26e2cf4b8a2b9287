"""Judges run in programs of their own, and are no tests."""

collect_ignore_glob = ["*"]
