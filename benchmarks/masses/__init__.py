"""Structures of masses and springs: identified, and watched for damage."""
