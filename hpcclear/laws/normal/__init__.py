"""Normal contact forces, one file a law or a family of laws."""
