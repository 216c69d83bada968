"""Link lengths from the required motion of the follower: loci of the driven joint and tests a mechanism must pass.

``rssr_locus`` and ``rssp_locus`` find the mechanisms of requirements; ``acceptance`` has the tests and the ends of the
admissible arcs; ``heddle`` synthesises heddle drives.
"""

from kernels.synthesis.acceptance import rssp_arc_ends as rssp_arc_ends
from kernels.synthesis.acceptance import rssr_arc_ends as rssr_arc_ends
from kernels.synthesis.rssp_locus import rssp_at_offset as rssp_at_offset
from kernels.synthesis.rssp_locus import rssp_at_place as rssp_at_place
from kernels.synthesis.rssp_locus import rssp_on_locus as rssp_on_locus
from kernels.synthesis.rssr_locus import rssr_at_direction as rssr_at_direction
from kernels.synthesis.rssr_locus import rssr_of_size as rssr_of_size
from kernels.synthesis.rssr_locus import rssr_on_locus as rssr_on_locus
from kernels.synthesis.rssr_locus import rssr_points as rssr_points
