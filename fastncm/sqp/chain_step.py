"""The Newton step of a finger in direct contact with its working set held."""

from fastncm.kernels.cache import inner
from fastncm.sqp.flexibility import carry_back, carry_flexibility, is_wide
from fastncm.sqp.wide_chain import solve_wide_chain


@inner
def solve_chain(problem, d, state, chain, size, own):
    """Step and multipliers with the working set ``chain.touching`` held; own: 1 for a Newton step,
    0 for the answer to a target that comes nearer by 1 at all contacts.

    Returns the excess of negative pivots.
    """
    if is_wide(chain):
        return solve_wide_chain(problem, d, state, chain, size, own)
    excess = carry_flexibility(problem, d, state, chain, size, own)
    carry_back(problem, d, state, chain, size, own)
    return excess
