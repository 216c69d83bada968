"""Interactive page on this machine, whose sliders change a mechanism, its curves, outputs and limits."""
