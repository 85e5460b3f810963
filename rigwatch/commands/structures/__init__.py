"""Commands on structures."""
