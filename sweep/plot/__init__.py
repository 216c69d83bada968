"""Pictures of mechanisms and datasets as matplotlib axes."""
