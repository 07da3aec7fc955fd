"""How the working set of a finger in direct contact changes: many contacts enter and leave at once.

With the working set held, some contacts pull and some points penetrate. Points side by side that
touch or penetrate are a zone, and a zone is changed by what its contacts say together:

* A long run of contacts is a pressure that shear lets end anywhere. Where it is held down beyond
  its true end it pulls there, and where it is held too short it presses, by the force per node next
  to the end times the number of nodes too many or too few, as a string would. So its ends come out
  after a few passes however many nodes they move over.
* Without shear a finger touches in points, and a force between two nodes is shared by both; where
  they are farther apart, or three, the outer ones pull. Their resultant acts where the point is.
* A single contact with penetration on one side only is moved to where the gaps have no slope: a
  scalar equation, solved by false position (the Illinois rule) between nodes that are known to be
  on either side.
"""

import numpy as np

from fastncm.kernels.cache import inlined, inner

#: Contacts side by side that stand for a force per node.
_RUN = 4
#: Contacts that may stand for a single one.
_FEW = 3
#: No contact.
NONE = -1


@inlined
def pulls(chain, k, slack):
    """Whether contact `k` pulls by more than `slack` (a force)."""
    return chain.touching[k] and chain.force[k] < -slack


@inlined
def penetrates(chain, k, depth):
    """Whether point `k`, which is not held, penetrates by more than `depth`."""
    return not chain.touching[k] and chain.gap[k] < -depth


@inlined
def count_wrong(chain, begin, end, slack, depth):
    """How many of the points [begin, end) pull or penetrate."""
    wrong = 0
    for k in range(begin, end):
        if pulls(chain, k, slack) or penetrates(chain, k, depth):
            wrong += 1
    return wrong


@inlined
def _overhang(chain, end, inward):
    """By how many nodes a run of contacts is too long (> 0) or too short (< 0) at its `end`, as a
    string."""
    share = 0.5 * (chain.force[end + inward] + chain.force[end + 2 * inward])
    if share <= 0.0:
        return 1
    nodes = np.ceil(-chain.force[end] / share)
    return int(min(max(nodes, -chain.force.shape[0]), chain.force.shape[0]))


@inlined
def _is_run(chain, end, inward, first, beyond):
    """True where `_RUN` contacts stand side by side from `end` on, within [first, beyond)."""
    if not first <= end + (_RUN - 1) * inward < beyond or not first <= end < beyond:
        return False
    for i in range(_RUN):
        if not chain.touching[end + i * inward]:
            return False
    return True


@inner
def _change_run(chain, first, beyond, slack):
    """Let go of what pulls in the run of contacts [first, beyond), and of its ends that a string
    would not hold."""
    mark, last = chain.mark, beyond - 1
    for k in range(first, beyond):
        if pulls(chain, k, slack):
            mark[k] = False
    if beyond - first < _RUN:
        return
    if pulls(chain, first, slack):
        for k in range(first, min(first + _overhang(chain, first, 1), beyond)):
            mark[k] = False
    if pulls(chain, last, slack):
        for k in range(last, max(last - _overhang(chain, last, -1), first - 1), -1):
            mark[k] = False


@inner
def _fill(chain, first, beyond, begin, end, slack):
    """Take in some of the penetrating points [first, beyond) of the zone [begin, end): what a
    string would touch next to a run; else the deepest, unless a contact beside it pulls."""
    mark, gap = chain.mark, chain.gap
    grown = False
    if _is_run(chain, first - 1, -1, begin, end):
        missing = -_overhang(chain, first - 1, -1)
        for k in range(first, min(first + missing, beyond)):
            mark[k] = True
        grown = missing > 0
    if _is_run(chain, beyond, 1, begin, end):
        missing = -_overhang(chain, beyond, 1)
        for k in range(beyond - 1, max(beyond - 1 - missing, first - 1), -1):
            mark[k] = True
        grown = grown or missing > 0
    beside = first > begin and pulls(chain, first - 1, slack)
    beside = beside or (beyond < end and pulls(chain, beyond, slack))
    if grown or beside:
        return
    deepest = first
    for k in range(first, beyond):
        if gap[k] < gap[deepest]:
            deepest = k
    mark[deepest] = True


@inner
def _gather(chain, begin, end, slack):
    """Replace the two or three contacts of the zone [begin, end), some of which pull, by the nodes
    around their resultant. Returns False where that is not what they are."""
    mark, force = chain.mark, chain.force
    first, last, count, pulling = NONE, NONE, 0, False
    total, moment = 0.0, 0.0
    for k in range(begin, end):
        if chain.touching[k]:
            first, last, count = k if first == NONE else first, k, count + 1
            pulling = pulling or pulls(chain, k, slack)
            total += force[k]
            moment += force[k] * (k - first)
    if not pulling or not 2 <= count <= _FEW or total <= 0.0:
        return False
    for k in range(first, last + 1):
        mark[k] = False
    place = first + moment / total
    if first <= place < last:
        mark[int(place)], mark[int(place) + 1] = True, True
    else:
        mark[int(min(max(place + 0.5, begin), end - 1.0))] = True
    return True


@inner
def change_working_set(chain, begin, end, slack, depth):
    """One change of the working set among the points [begin, end), which stand side by side.

    slack, depth: force and penetration that are rounding.
    """
    touching, mark = chain.touching, chain.mark
    for k in range(begin, end):
        mark[k] = touching[k]
    k = begin
    while k < end:
        zone = k
        while k < end and (touching[k] or penetrates(chain, k, depth)):
            k += 1
        if k == zone:
            k += 1
        elif not _gather(chain, zone, k, slack):
            first = zone
            while first < k:
                beyond = first
                while beyond < k and touching[beyond] == touching[first]:
                    beyond += 1
                if touching[first]:
                    _change_run(chain, first, beyond, slack)
                else:
                    _fill(chain, first, beyond, zone, k, slack)
                first = beyond
    for k in range(begin, end):
        touching[k] = mark[k]


@inner
def lone_contact(chain, begin, end, points, depth):
    """The only contact where it is one of the nodes [begin, end) and all penetration lies on one
    side of it and next to it; of all points [begin, points).

    Returns ``(its index or NONE, +1 or -1, the side of the penetration)``.
    """
    lone, before, after = NONE, False, False
    for k in range(begin, points):
        if chain.touching[k]:
            if lone != NONE or k >= end:
                return NONE, 0
            lone = k
        elif penetrates(chain, k, depth):
            if k >= end:
                return NONE, 0
            before, after = before or lone == NONE, after or lone != NONE
    if lone == NONE or before == after:
        return NONE, 0
    side = 1 if after else -1
    if not begin <= lone + side < end or not penetrates(chain, lone + side, depth):
        return NONE, 0
    return lone, side
