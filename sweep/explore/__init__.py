"""A design in hand: a page on this machine whose sliders move a mechanism, its curves, outputs and limits."""
