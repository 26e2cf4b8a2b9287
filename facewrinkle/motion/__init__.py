"""Motions that move the base mesh: the simulated skin with its joints and contacts, or one of your own."""
