"""Proofs that no design of a space is better: branch and bound over boxes of designs (docs/proof.md).

``question`` reads the question from a study, ``rounds`` distributes the boxes over the cores, ``certificate`` writes
and reads the proof.
"""

from sweep.proof.certificate import Proof as Proof
from sweep.proof.certificate import read_proof as read_proof
from sweep.proof.study import known_proof as known_proof
from sweep.proof.study import prove_study as prove_study
