"""From a requirement to mechanisms: loci, acceptance tests, and the eight tasks of the engineering method."""

from sweep.synthesis.locus import LOCI as LOCI
from sweep.synthesis.locus import admissible_arcs as admissible_arcs
from sweep.synthesis.locus import locus_designs as locus_designs
from sweep.synthesis.mechanisms import synthesise as synthesise
