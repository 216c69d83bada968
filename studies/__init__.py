"""Questions stated as data: one folder per study."""
