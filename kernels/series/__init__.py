"""One fused kernel per chain: a loop over the crank angle in which each stage hands its output angle to the next.

``form`` says what is needed of a stage, ``links`` hands motion on between stages, ``chain`` composes the stages'
closures into those of the chain, ``dense`` and ``search`` generate the kernels from them.

Parts of the search: ``curves``; their samples (``halves``) of a block of designs (``abreast``) or of one (``look``);
the ``listing`` of local maxima among them and their refinement (``peaks``).  Which families have a form is theirs to
say.
docs/chain.md, docs/extrema.md.
"""

from kernels.series.chain import Chained as Chained
from kernels.series.chain import chained as chained
from kernels.series.dense import dense_maxima as dense_maxima
from kernels.series.form import Form as Form
from kernels.series.look import OPEN as OPEN
from kernels.series.look import sampling_tables as sampling_tables
from kernels.series.search import ROUNDED as ROUNDED
from kernels.series.search import find_extrema as find_extrema
