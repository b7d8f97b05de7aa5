"""Levels of the inputs of a structure, each free on its own, where only its motion is known."""
