"""Structures of masses, springs and dampers: described as data, identified from their motion."""
