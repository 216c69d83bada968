"""Where searches begin: samples, datasets, populations of descents."""
