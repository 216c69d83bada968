"""One fused kernel per chain: a loop over the crank angle in which each stage hands its output angle to the next.

``form`` lists the closures of a stage, ``links`` passes motion on between stages, ``chain`` composes the stages'
closures into those of the chain, ``dense``, ``search`` and ``means`` generate the kernels from them.

Parts of the search: ``curves``; their samples (``halves``) of a block of designs (``lanes``) or of one (``look``);
the ``listing`` of local maxima among them and their refinement (``peaks``).  Families define their own forms.
docs/chain.md, docs/internals/extrema.md.
"""

from kernels.chains.chain import Chained as Chained
from kernels.chains.chain import chained as chained
from kernels.chains.dense import dense_maxima as dense_maxima
from kernels.chains.form import Form as Form
from kernels.chains.look import OPEN as OPEN
from kernels.chains.look import sampling_tables as sampling_tables
from kernels.chains.means import mean_squares as mean_squares
from kernels.chains.search import ROUNDED as ROUNDED
from kernels.chains.search import find_extrema as find_extrema
