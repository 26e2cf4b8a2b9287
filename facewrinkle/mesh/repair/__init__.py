"""Repair: a surface that anyone brings becomes one that the algorithms can rely on."""
