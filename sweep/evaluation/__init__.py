"""``evaluate`` and ``summarise``: pose outputs and design outputs of given designs in a table."""
