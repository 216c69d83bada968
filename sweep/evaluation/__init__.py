"""``evaluate`` and ``summarise``: given designs in a table, their motion and what a whole turn says about them."""
