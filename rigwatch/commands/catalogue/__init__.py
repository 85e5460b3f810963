"""Commands on what there is to choose from: effects and models."""
