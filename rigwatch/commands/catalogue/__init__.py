"""Commands on what there is to choose from: effects, with their library as text, and models."""
