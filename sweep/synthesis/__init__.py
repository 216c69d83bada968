"""From a requirement to mechanisms: loci, acceptance tests, and the eight tasks of the engineering method."""
