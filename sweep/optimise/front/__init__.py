"""The least objective for each bound on a second output."""
