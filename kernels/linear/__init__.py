"""Linear algebra for compiled loops: elimination, nearest points under linear rows, a straight-line fit."""
