"""Normal contact forces, one file a law."""
