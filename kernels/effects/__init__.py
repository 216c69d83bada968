"""One effect per file; an effect takes joint coordinates, directions and loads and need not know the family."""
