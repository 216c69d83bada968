"""One mechanism family per file; families never import each other."""
